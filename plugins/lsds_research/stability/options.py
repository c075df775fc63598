"""Options of every map."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from lsds.cli.threads import processes
from lsds_research.campaign_options import Cluster, Jobs, Out


class StabilityOptions(BaseModel):
    """Map where methods fail: one figure at every point of a grid, for the shipped methods and for naive ones.

    Figures are simulated; docs/stability.md lists the maps.

    Takes: 10 s to 3 minutes with --quick on two cores, up to an hour without.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    methods: list[str] = Field(
        default=[],
        description="method to measure; default: all of the map",
        json_schema_extra={"flag": "--method", "metavar": "NAME"},
    )
    quick: bool = Field(default=False, description="a coarse grid with one seed")
    out: Out = ""
    jobs: Jobs = Field(default_factory=processes, description="processes that measure points")
    cluster: Cluster = ""
