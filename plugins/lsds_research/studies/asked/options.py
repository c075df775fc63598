"""Options of the study `asked`."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from lsds.cli.threads import processes
from lsds_research.collecting.objects import PIPE, UNSEEN


class AskedOptions(BaseModel):
    """Ask detectors and estimators in every frame of simulated trials, as in the running cell.

    Trials slide, turn, or load an object that does not slip, on objects that no shipped model was trained on. Figures
    are simulated.

    \b
    Examples:
      lsds study asked --estimator fused --estimator imprint
      lsds study asked --quick --json asked.json
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    objects: list[str] = Field(
        default=[*UNSEEN, PIPE],
        description="object of the catalogue",
        json_schema_extra={"flag": "--object", "metavar": "NAME"},
    )
    detectors: list[str] = Field(
        default=[],
        description="detector to ask; default: all installed ones",
        json_schema_extra={"flag": "--detector", "metavar": "NAME"},
    )
    estimators: list[str] = Field(
        default=[],
        description="estimator to ask; default: all installed ones",
        json_schema_extra={"flag": "--estimator", "metavar": "NAME"},
    )
    quick: bool = Field(default=False, description="a tenth of the trials")
    jobs: int = Field(default_factory=processes, ge=1, le=256, description="processes that run trials")
