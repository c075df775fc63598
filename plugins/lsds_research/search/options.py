"""Options of the search."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from lsds.cli.threads import processes
from lsds_research.cluster import HELP


class SearchOptions(BaseModel):
    """Look for scenarios in which the cell fails.

    A scenario is a point in ranges of config keys: object, friction, gel, optics, timing, task. Half of the runs look
    everywhere; the others go downhill from the worst places, towards a drop, a long slip, a crushing grip, an opening,
    a hang or an error without a name. Each failure is shrunk to the fewest keys that still fail, and saved as a file
    that lsds run replays. Figures are simulated.

    \b
    Examples:
      lsds search --quick
      lsds search --runs 300 --found failures/ --out search.jsonl --plot search.png
      lsds search --space ranges.toml --with controller.backend=pd
      lsds run failures/holds-1.toml
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    runs: int = Field(default=200, ge=8, le=1_000_000, description="scenarios that are run, without the shrinking")
    space: str = Field(
        default="",
        description="TOML file of ranges: a config key with [least, greatest], or with a list of choices",
        json_schema_extra={"metavar": "FILE"},
    )
    found: str = Field(
        default="", description="folder for the failures that were found", json_schema_extra={"metavar": "FOLDER"}
    )
    most: int = Field(default=5, ge=0, le=100, description="failures that are shrunk and saved, the worst ones")
    slip_mm: float = Field(default=30.0, gt=0, le=1000, description="a longer slip is a failure")
    peak: float = Field(
        default=5.0, gt=1, le=1000, description="a peak grip over what is needed beyond this is a failure"
    )
    settings: list[str] = Field(
        default=[],
        description="one more config key of every run",
        json_schema_extra={"flag": "--with", "metavar": "KEY=VALUE"},
    )
    out: str = Field(
        default="",
        description="keep each run in this file (JSON lines); the same command goes on where it ended",
        json_schema_extra={"metavar": "FILE"},
    )
    quick: bool = Field(default=False, description="48 runs, one failure shrunk")
    jobs: int = Field(default_factory=processes, ge=1, le=256, description="processes that run scenarios")
    cluster: str = Field(default="", description=HELP, json_schema_extra={"metavar": "ADDRESS"})
