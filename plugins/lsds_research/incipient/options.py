"""Options of the study `incipient-slip`."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field, field_validator

from lsds.cli.threads import processes


class IncipientOptions(BaseModel):
    """Classify real recordings as slip or no slip, on held-out objects.

    The folder holds index.csv (columns video, recording, object, camera, slip, and optionally
    label_conflict) and the videos that it names. All models get clips of equal length, because the length of a
    recording reveals its label. The table compares offline with causal models and both with controls: a threshold on
    one feature, the majority class, shuffled labels and nuisance controls. A video that cannot be read is reported and
    left out.

    Takes: minutes; the videos are read once and cached.

    \b
    Examples:
      lsds study incipient-slip recordings/ --plot roc.png
      lsds study incipient-slip new-objects/ --train recordings/ --jobs 4
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    path: str = Field(
        description="folder with index.csv and videos", json_schema_extra={"metavar": "FOLDER", "argument": True}
    )
    train: str = Field(
        default="",
        description="also train on all objects of this folder and test on those of PATH",
        json_schema_extra={"metavar": "FOLDER"},
    )
    model: str = Field(
        default="shipped",
        description="simulation-trained detector to score: a file (.onnx), 'shipped' or 'none'",
        json_schema_extra={"metavar": "FILE"},
    )
    slower: float = Field(
        default=3.0,
        ge=0.1,
        le=100,
        description="true over nominal frame interval; the rates given to --model are divided by it",
    )
    save_model: str = Field(
        default="",
        description="fit the clip model on the whole folder and write it to this .onnx",
        json_schema_extra={"flag": "--save-clip-model", "metavar": "FILE", "writes": True},
    )
    cache: str = Field(
        default="",
        description="folder that caches the videos read; default: the user's cache folder; 'none': no cache",
        json_schema_extra={"metavar": "DIR"},
    )
    jobs: int = Field(
        default_factory=processes, ge=1, le=256, description="processes that read videos, and threads that train"
    )
    repeats: int = Field(default=3, ge=1, le=50, description="number of random assignments of objects to folds")
    trees: int = Field(default=300, ge=10, le=5000, description="number of trees of the clip model")

    @field_validator("save_model")
    @classmethod
    def _is_onnx(cls, name: str) -> str:
        if name and not name.endswith(".onnx"):
            raise ValueError("names a file that ends in .onnx")
        return name
