"""Options of the study `incipient-slip`."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field, field_validator

from lsds.cli.threads import processes


class IncipientOptions(BaseModel):
    """Separate recordings with slip from those without, on objects never trained on.

    The folder holds index.csv (columns video, recording, object, camera, slip, and label_conflict if need be) and the
    videos that it names. All models see clips of equal length, because a recording's length reveals its label. Offline
    figures stand next to causal ones, and next to the rule of one number, the majority, shuffled labels and nuisances.
    A video that cannot be read is reported and left out.

    \b
    Examples:
      lsds study incipient-slip --path recordings/
      lsds study incipient-slip --path new-objects/ --train recordings/ --jobs 4
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    path: str = Field(description="folder with index.csv and videos", json_schema_extra={"metavar": "FOLDER"})
    train: str = Field(
        default="",
        description="also train on this folder's objects and test on those of the other",
        json_schema_extra={"metavar": "FOLDER"},
    )
    model: str = Field(
        default="shipped",
        description="simulation-trained detector (.onnx) to apply as it is, 'shipped' or 'none'",
        json_schema_extra={"metavar": "FILE"},
    )
    slower: float = Field(
        default=3.0,
        ge=0.1,
        le=100,
        description="true frame interval over the nominal: divides the rates that --model sees",
    )
    save_model: str = Field(
        default="",
        description="fit the clip model on the whole folder and write it to this .onnx",
        json_schema_extra={"flag": "--save-clip-model", "metavar": "FILE", "writes": True},
    )
    cache: str = Field(
        default="",
        description="keep what was read there; empty for the user's cache folder, 'none' keeps nothing",
        json_schema_extra={"metavar": "DIR"},
    )
    jobs: int = Field(
        default_factory=processes, ge=1, le=256, description="processes that read videos, and threads that train"
    )
    repeats: int = Field(default=3, ge=1, le=50, description="times that objects are dealt out to folds anew")
    trees: int = Field(default=300, ge=10, le=5000, description="of the clip model")

    @field_validator("save_model")
    @classmethod
    def _is_onnx(cls, name: str) -> str:
        if name and not name.endswith(".onnx"):
            raise ValueError("names a file that ends in .onnx")
        return name
