"""Options of the search."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from lsds.cli.threads import processes
from lsds_research.campaign_options import Cluster, Jobs, Out, Random, Settings


class SearchOptions(BaseModel):
    """Look for scenarios in which the cell fails.

    A scenario is a point in ranges of config keys: object, friction, gel, optics, timing, task. A quarter to a half of
    the runs cover the whole space. The others descend from the worst points towards a drop, a long slip, a crushing
    grip, an opening, a hang or an unexpected error. Each failure is shrunk to few keys and saved as a file that
    lsds run replays. Figures are simulated.

    Takes: 1 to 3 s of one core per lift (--runs).

    \b
    Examples:
      lsds study search --quick
      lsds study search --runs 300 --found failures/ \\
          --out search.jsonl --plot search.png
      lsds study search --space ranges.toml --with controller.backend=pd
      lsds run failures/holds-1.toml
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    runs: int = Field(
        default=200, ge=8, le=1_000_000, description="number of scenarios, without those of the shrinking"
    )
    space: str = Field(
        default="",
        description="TOML file of ranges: a config key with [least, greatest], or with a list of choices",
        json_schema_extra={"metavar": "FILE"},
    )
    random: Random = False
    found: str = Field(
        default="",
        description="folder for the failures found",
        json_schema_extra={"metavar": "FOLDER", "writes": "folder"},
    )
    most: int = Field(default=5, ge=0, le=100, description="number of failures to shrink and save, the worst first")
    slip_mm: float = Field(default=30.0, gt=0, le=1000, description="a longer slip is a failure")
    peak: float = Field(
        default=5.0, gt=1, le=1000, description="a higher ratio of peak grip to needed grip is a failure"
    )
    settings: Settings = []
    out: Out = ""
    quick: bool = Field(default=False, description="48 runs, one failure shrunk, unless --runs and --most are given")
    jobs: Jobs = Field(default_factory=processes, description="processes that run scenarios")
    cluster: Cluster = ""
