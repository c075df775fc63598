"""Options of the study `loop`."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from lsds.cli.threads import processes
from lsds_research.campaign_options import Jobs, Out

OBJECTS = ("pvc-pipe", "can", "battery", "book", "candle", "scissors")
PAIRS = (
    "threshold+field",
    "rigid-residual+field",
    "monotone+field",
    "field-mlp+field-gru",
    "imprint+imprint",
    "fused+fused",
)


class LoopOptions(BaseModel):
    """Whole configurations: computing time of a frame against slip distance and steady grip.

    A configuration is a tracker, a detector and an estimator (`--pair`; some use the object's imprint, some the
    markers only), a controller, and a budget of time for a frame (`tactile.budget_ms`, --budget-ms; none by default).
    Each lifts every object. Slip and grip are simulated; the time is the mean over frames on this machine. The front is
    the Pareto front of time, slip and grip.

    Takes: 1 to 3 s of one core per lift.

    \b
    Examples:
      lsds study loop --quick
      lsds study loop --tracker lk --controller belief --out loop.jsonl
      lsds study loop --tracker lk --pair fused+fused --controller belief \\
          --budget-ms 0 --budget-ms 1 --budget-ms 1.3 --plot budgets.png
      lsds study choose --max-slip 5mm --max-grip 1.5 --budget 1ms \\
          --runs loop.jsonl
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    trackers: list[str] = Field(
        default=["lk", "centroid"],
        min_length=1,
        description="tracker",
        json_schema_extra={"flag": "--tracker", "metavar": "NAME"},
    )
    pairs: list[str] = Field(
        default=[*PAIRS],
        min_length=1,
        description="detector and estimator",
        json_schema_extra={"flag": "--pair", "metavar": "DETECTOR+ESTIMATOR"},
    )
    controllers: list[str] = Field(
        default=["belief", "pd"],
        min_length=1,
        description="controller",
        json_schema_extra={"flag": "--controller", "metavar": "NAME"},
    )
    budgets_ms: list[Annotated[float, Field(ge=0, le=1000)]] = Field(
        default=[0.0],
        min_length=1,
        description="budget of time for a frame, ms; 0: none",
        json_schema_extra={"flag": "--budget-ms", "metavar": "MS"},
    )
    objects: list[str] = Field(
        default=[*OBJECTS],
        min_length=1,
        description="object of the catalogue that is lifted",
        json_schema_extra={"flag": "--object", "metavar": "NAME"},
    )
    squeezes_mm: list[float] = Field(
        default=[0.7, 1.4],
        min_length=1,
        description="first squeeze, mm",
        json_schema_extra={"flag": "--squeeze-mm", "metavar": "MM"},
    )
    out: Out = ""
    quick: bool = Field(default=False, description="one tracker, every other object, one squeeze")
    jobs: Jobs = Field(default_factory=processes, description="processes that run lifts")
