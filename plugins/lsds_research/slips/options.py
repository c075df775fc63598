"""Options of the study `slip`."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from lsds.cli.threads import processes


class SlipOptions(BaseModel):
    """Score detectors and estimators frame by frame, on real recordings labelled by eye.

    The folder holds the recordings, videos or folders of images, anywhere below it, and slip_labels.csv (lsds learn
    label). For the public incipient-slip set the labels are shipped. Scores are over frames of which the label is sure.

    Takes: about the duration of the recordings, for each detector and estimator.

    \b
    Examples:
      lsds study slip recordings/
      lsds study slip recordings/ --detector imprint --detector monotone \\
          --plot curves.png
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    path: str = Field(
        description="folder with recordings and slip_labels.csv",
        json_schema_extra={"metavar": "FOLDER", "argument": True},
    )
    labels: str = Field(
        default="",
        description="file of labels; default: slip_labels.csv in the folder, else the shipped ones",
        json_schema_extra={"metavar": "FILE"},
    )
    detectors: list[str] = Field(
        default=[],
        description="detector to score; repeatable; default: all installed ones",
        json_schema_extra={"flag": "--detector", "metavar": "NAME"},
    )
    estimators: list[str] = Field(
        default=[],
        description="estimator to score; repeatable; default: all installed ones",
        json_schema_extra={"flag": "--estimator", "metavar": "NAME"},
    )
    objects: Literal["scored-only", "all"] = Field(
        default="scored-only",
        description="scored-only: of the shipped labels, only objects on which nothing is tuned; all: every object",
    )
    refit: bool = Field(
        default=True, description="also fit the learner 'fused' without each object, and on the other setup"
    )
    simulated: list[str] = Field(
        default=[],
        description="simulated dataset (lsds learn collect) to fit 'fused' on as well, and alone; repeatable",
        json_schema_extra={"metavar": "FOLDER"},
    )
    alarms: float = Field(
        default=5.0, gt=0, le=50, description="false alarms per 100 moving frames at which detectors are compared"
    )
    jobs: int = Field(default_factory=processes, ge=1, le=256, description="processes that read recordings")
