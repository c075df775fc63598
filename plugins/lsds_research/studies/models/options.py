"""Options of the studies of learned models."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

_FOLDER: dict[str, Any] = {"metavar": "FOLDER"}
_DATASET = "folder of a dataset, from lsds learn collect or in data/ of lsds study reproduce"


class TradeoffOptions(BaseModel):
    """Options shared by the studies of detectors and of estimators."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    data: str = Field(description=_DATASET, json_schema_extra=_FOLDER)
    most: int = Field(default=20_000, ge=500, description="number of windows to fit on, drawn at random")
    repeats: int = Field(default=10, ge=1, le=1000, description="number of timed passes over the frames")
    seed: int = Field(default=0, ge=0, description="seed of the fits and of the simulated run")


class DetectorsOptions(TradeoffOptions):
    """Measure detectors: accuracy on held-out objects against computing time per update. Needs the train extra.

    Takes: minutes per model, less with --most.

    \b
    Examples:
      lsds study detectors --data reproduction/data/detection
      lsds study detectors --data detection --most 5000 --csv detectors.csv
    """


class EstimatorsOptions(TradeoffOptions):
    """Measure estimators: R2 of speed on held-out objects against computing time per update. Needs the train extra.

    Takes: minutes per model, less with --most.

    \b
    Examples:
      lsds study estimators --data reproduction/data/severity
      lsds study estimators --data severity --most 5000 --json estimators.json
    """


class LearningOptions(BaseModel):
    """Measure the learning curve: scores on held-out objects against the number of training objects.

    Needs the train extra.

    Takes: minutes per learner and repeat.

    \b
    Examples:
      lsds study learning --data severity --also pipe
      lsds study learning --data detection --learner field-mlp \\
          --learner logistic --repeats 3
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    data: str = Field(description=_DATASET, json_schema_extra=_FOLDER)
    also: str = Field(
        default="", description="another dataset to score on, not used for training", json_schema_extra=_FOLDER
    )
    learners: list[str] = Field(
        default=["linear-window", "field-gru"],
        min_length=1,
        description="learner to fit; repeatable, all detectors or all estimators",
        json_schema_extra={"flag": "--learner", "metavar": "NAME"},
    )
    repeats: int = Field(default=1, ge=1, le=100, description="number of random orders of the objects")
    seed: int = Field(default=0, ge=0, description="seed of the orders and of the fits")


class ModelsOptions(BaseModel):
    """Score finished models on the objects of a dataset that they were not trained on. Nothing is trained.

    The dataset is a folder written by lsds learn collect, or one in data/ of lsds study reproduce. Needs the
    data extra.

    Takes: seconds per model.

    \b
    Examples:
      lsds study models detection
      lsds study models severity --model field-gru --model mine.onnx \\
          --plot speeds.png
      lsds study models detection --job estimate --object book --json book.json
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    data: str = Field(description=_DATASET, json_schema_extra={"metavar": "FOLDER", "argument": True})
    models: list[str] = Field(
        default=[],
        description="shipped model, or file (.onnx) of lsds learn train; repeatable; default: all shipped models",
        json_schema_extra={"flag": "--model", "metavar": "NAME|FILE"},
    )
    job: Literal["", "detect", "estimate"] = Field(
        default="", description="job of the models to score; default: that of the dataset"
    )
    objects: list[str] = Field(
        default=[],
        description="object to score on; repeatable; default: all objects that no model was trained on",
        json_schema_extra={"flag": "--object", "metavar": "NAME"},
    )
