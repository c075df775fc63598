"""Options of every map."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from lsds.cli.threads import processes
from lsds_research.campaign_options import Cluster, Jobs, Out


class PointOptions(BaseModel):
    """How points are measured: the grid, and where the runs go."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    quick: bool = Field(default=False, description="a coarse grid with one seed")
    out: Out = ""
    jobs: Jobs = Field(default_factory=processes, description="processes that measure points")
    cluster: Cluster = ""


class StabilityOptions(PointOptions):
    """Map where methods fail: one figure at every point of a grid, for the shipped methods and for naive ones.

    Figures are simulated; docs/stability.md lists the maps.

    Takes: 10 s to 3 minutes with --quick on two cores, up to an hour without.
    """

    methods: list[str] = Field(
        default=[],
        description="method to measure; default: all of the map",
        json_schema_extra={"flag": "--method", "metavar": "NAME"},
    )


class AllMapsOptions(PointOptions):
    """Map where methods fail: all stability maps in one run, with the safe share of each method.

    `lsds study stability-NAME` runs one map. Figures are simulated; docs/stability.md lists the
    maps.

    Takes: 3 to 10 minutes with --quick on two cores, hours without; --out lets it continue.
    """

    maps: list[str] = Field(
        default=[],
        description="map to measure; default: all",
        json_schema_extra={"flag": "--map", "metavar": "NAME"},
    )
    folder: str = Field(
        default="",
        description="folder for picture, CSV and JSON of each map",
        json_schema_extra={"metavar": "FOLDER", "writes": "folder"},
    )
