"""Options of the study `risk`."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from lsds.cli.threads import processes
from lsds_research.campaign_options import Cluster, Jobs, Out, Random, Settings


class RiskOptions(BaseModel):
    """Estimate the probability of a failure in scenarios drawn uniformly from ranges of config keys.

    Multilevel splitting varies the worst tenth of the scenarios at random into a full level that is no better, and
    repeats this until a tenth fails. A probability of one in a million then takes some thousand runs. With --plain,
    scenarios are drawn and failures counted. Figures are simulated.

    Takes: 1 to 3 s of one core per lift.

    \b
    Examples:
      lsds study risk --quick
      lsds study risk --with cell.simulated.object=pvc-pipe \\
          --out pipe.jsonl --json pipe.json
      lsds study risk --space ranges.toml --failure any --runs 200
      lsds study risk --plain --runs 3000 --space ranges.toml
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    failure: Literal["drop", "slip", "any"] = Field(
        default="drop",
        description="drop: the object falls; slip: it slips by more than --slip-mm; any: crush, opening, hang, too",
    )
    slip_mm: float = Field(
        default=60.0, gt=0, le=1000, description="a longer slip is a failure; the object falls after 60"
    )
    peak: float = Field(
        default=5.0, gt=1, le=1000, description="a higher ratio of peak grip to needed grip is a failure, with any"
    )
    space: str = Field(
        default="",
        description="TOML file of ranges as for lsds study search; default: the space of lsds study search",
        json_schema_extra={"metavar": "FILE"},
    )
    random: Random = False
    runs: int = Field(
        default=100, ge=20, le=1_000_000, description="number of scenarios per level, or in total with --plain"
    )
    plain: bool = Field(default=False, description="draw and count, without splitting")
    settings: Settings = []
    out: Out = ""
    quick: bool = Field(default=False, description="20 scenarios unless --runs is given, counted")
    jobs: Jobs = Field(default_factory=processes, description="processes that run scenarios")
    cluster: Cluster = ""
