"""Options of the study `grip`."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from lsds.cli.threads import processes
from lsds_research.campaign_options import Cluster, Jobs, Out, Settings
from lsds_research.collecting.objects import PLANS

Change = Literal["none", "pour", "shove", "wet", "brisk", "turn"]


class GripOptions(BaseModel):
    """Lift unknown objects with each controller, and compare grip, slip and drops.

    Every combination of object, first squeeze, lifting speed, friction of the day, change of load and seed is one run:
    grasp by touch, lift, hold. Figures are simulated.

    Takes: 1 to 3 s of one core per lift, two or three lifts for each random object; --quick makes 63 lifts.

    \b
    Examples:
      lsds study grip --quick
      lsds study grip --controller belief --controller pd \\
          --out runs.jsonl --plot grip.png
      lsds study grip --object ball --change pour --change shove \\
          --seeds 5 --json grip.json
      lsds study grip --controller belief --probe \\
          --with gripper.mock-hand-e.latency_ms=200
      lsds study grip --random 60 --controller belief --json random.json
      lsds study grip --random 40 --controller belief --sensitivity \\
          --out sensitivity.jsonl
      lsds study grip --cluster tcp://10.0.0.5:8786
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    objects: list[str] = Field(
        default=[*PLANS],
        description="object of the catalogue; default: all",
        json_schema_extra={"flag": "--object", "metavar": "NAME"},
    )
    controllers: list[str] = Field(
        default=[],
        description="controller, or 'off' for a fixed grip; default: all installed ones and 'off'",
        json_schema_extra={"flag": "--controller", "metavar": "NAME"},
    )
    squeezes_mm: list[float] = Field(
        default=[0.7, 1.4, 2.8],
        min_length=1,
        description="first squeeze, mm",
        json_schema_extra={"flag": "--squeeze-mm", "metavar": "MM"},
    )
    speeds_m_s: list[float] = Field(
        default=[0.02, 0.038, 0.08],
        min_length=1,
        description="lifting speed, m/s",
        json_schema_extra={"flag": "--speed", "metavar": "M/S"},
    )
    frictions: list[float] = Field(
        default=[1.0],
        min_length=1,
        description="friction of the day, as a factor",
        json_schema_extra={"flag": "--friction", "metavar": "FACTOR"},
    )
    changes: list[Change] = Field(
        default=["none"],
        min_length=1,
        description="change of load while the object hangs: none, pour (to twice the weight in 3 s), shove, wet (half "
        "the friction), brisk (lift at 2 m/s^2), turn (gripped 10 mm off its centre)",
        json_schema_extra={"flag": "--change", "metavar": "NAME"},
    )
    seeds: int = Field(default=1, ge=1, le=10_000, description="number of seeds, each with another gel")
    random: int = Field(
        default=0,
        ge=0,
        le=10_000,
        description="number of objects drawn at random, instead of those of the catalogue; only objects count that "
        "one of three lifts with a firm grip holds",
    )
    draw: int = Field(default=1001, ge=0, description="number of the draw of random objects; 0 is for development")
    probe: bool = Field(default=False, description="look for the least grip before the lift (task.probe)")
    fragile: float = Field(
        default=0.0,
        ge=0,
        le=100,
        description="objects that bear this many times the needed force (task.fragile_n); 0: any force",
    )
    sensitivity: bool = Field(
        default=False,
        description="vary each parameter of [grip] and of the one controller: 0.7 and 1.3 times its value",
    )
    settings: Settings = []
    out: Out = ""
    quick: bool = Field(default=False, description="one speed, and every third object")
    jobs: Jobs = Field(default_factory=processes, description="processes that run lifts")
    cluster: Cluster = ""
