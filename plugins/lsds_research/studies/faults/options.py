"""Options of the study `faults`."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from lsds.cli.threads import processes
from lsds_research.campaign_options import Cluster, Jobs, Out, Settings

Moment = Literal["approach", "squeeze", "take up", "lift", "slip", "hold"]


class FaultsOptions(BaseModel):
    """Let parts of the cell fail while an object is lifted, and compare with the same run without the fault.

    Every combination of fault, severity, moment and seed is a run. A fault is stopped (an expected error), harmless
    (the same outcome), or missed. Figures are simulated.

    Takes: 1 to 3 s of one core per lift; --quick makes 65 lifts.

    \b
    Examples:
      lsds study faults --quick
      lsds study faults --fault gripper-stuck --fault camera-frozen \\
          --moment lift --seeds 5
      lsds study faults --out faults.jsonl --plot faults.png --json faults.json
      lsds study faults --rig examples/rigs/wire.toml --jobs 1 \\
          --fault gripper-crc --moment lift
      lsds study faults --controller belief --controller pd \\
          --fault camera-late --fault camera-drops
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    faults: list[str] = Field(
        default=[],
        description="fault of an installed plugin; default: all",
        json_schema_extra={"flag": "--fault", "metavar": "NAME"},
    )
    severities: list[Annotated[int, Field(ge=1, le=5)]] = Field(
        default=[1, 2, 3, 4, 5],
        min_length=1,
        description="severity, 1 to 5",
        json_schema_extra={"flag": "--severity", "metavar": "N"},
    )
    moments: list[Moment] = Field(
        default=["approach", "squeeze", "lift", "slip", "hold"],
        min_length=1,
        description="when the fault begins: approach, squeeze, take up, lift, slip (the first alarm), hold",
        json_schema_extra={"flag": "--moment", "metavar": "NAME"},
    )
    seeds: int = Field(default=1, ge=1, le=10_000, description="number of seeds, each with another gel")
    controllers: list[str] = Field(
        default=["belief"],
        min_length=1,
        description="controller; default with --rig: that of the file",
        json_schema_extra={"flag": "--controller", "metavar": "NAME"},
    )
    detectors: list[str] = Field(
        default=["fused"],
        min_length=1,
        description="detector; default with --rig: that of the file",
        json_schema_extra={"flag": "--detector", "metavar": "NAME"},
    )
    rig: str = Field(
        default="",
        description="rig file instead of the default rig and task; a rig of real drivers runs in real time and needs "
        "--jobs 1",
        json_schema_extra={"metavar": "FILE"},
    )
    settings: Settings = []
    out: Out = ""
    quick: bool = Field(
        default=False,
        description="every third fault, severities 3 and 5, lift and slip, one seed, if not given",
    )
    jobs: Jobs = Field(default_factory=processes, description="processes that run lifts")
    cluster: Cluster = ""
