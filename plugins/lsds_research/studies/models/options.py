"""Options of the studies of learned models."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

_FOLDER: dict[str, Any] = {"metavar": "FOLDER"}
_DATASET = "folder of a dataset: lsds collect, or data/ of lsds reproduce"


class TradeoffOptions(BaseModel):
    """Options that both jobs share."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    data: str = Field(description=_DATASET, json_schema_extra=_FOLDER)
    most: int = Field(default=20_000, ge=500, description="windows to fit on, drawn from all: enough to compare")
    repeats: int = Field(default=10, ge=1, le=1000, description="passes over the frames that are timed")
    seed: int = Field(default=0, ge=0, description="of fits and of the simulated run")


class DetectorsOptions(TradeoffOptions):
    """Measure detectors: accuracy on objects never seen against the time of an update. Needs the train extra.

    \b
    Examples:
      lsds study detectors --data reproduction/data/detection
      lsds study detectors --data detection --most 5000 --csv detectors.csv
    """


class EstimatorsOptions(TradeoffOptions):
    """Measure estimators: R2 of speed on objects never seen against the time of an update. Needs the train extra.

    \b
    Examples:
      lsds study estimators --data reproduction/data/severity
      lsds study estimators --data severity --most 5000 --json estimators.json
    """


class LearningOptions(BaseModel):
    """Measure the learning curve: scores on objects never seen by the number of objects to learn from.

    Needs the train extra.

    \b
    Examples:
      lsds study learning --data severity --also pipe
      lsds study learning --data detection --learner field-mlp --learner logistic --repeats 3
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    data: str = Field(description=_DATASET, json_schema_extra=_FOLDER)
    also: str = Field(
        default="", description="another dataset to score on; nothing is learnt from it", json_schema_extra=_FOLDER
    )
    learners: list[str] = Field(
        default=["linear-window", "field-gru"],
        min_length=1,
        description="a learner; repeatable, all of one job",
        json_schema_extra={"flag": "--learner", "metavar": "NAME"},
    )
    repeats: int = Field(default=1, ge=1, le=100, description="orders of the objects")
    seed: int = Field(default=0, ge=0, description="of the orders and of the fits")


class ModelsOptions(BaseModel):
    """Score models as they are on a dataset's objects that they have not learnt from. Nothing is trained.

    The dataset is a folder of lsds collect, or one in data/ of lsds reproduce. Needs the data extra.

    \b
    Examples:
      lsds study models --data detection
      lsds study models --data severity --model field-gru --model mine.onnx --plot speeds.png
      lsds study models --data detection --job estimate --object book --json book.json
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    data: str = Field(description=_DATASET, json_schema_extra=_FOLDER)
    models: list[str] = Field(
        default=[],
        description="a shipped model, or a file (.onnx) of lsds train; repeatable, all shipped where none is named",
        json_schema_extra={"flag": "--model", "metavar": "NAME|FILE"},
    )
    job: Literal["", "detect", "estimate"] = Field(
        default="", description="what the models are for; by the dataset where it is not given"
    )
    objects: list[str] = Field(
        default=[],
        description="object to score on; repeatable, where none is named all that no model has learnt from",
        json_schema_extra={"flag": "--object", "metavar": "NAME"},
    )
