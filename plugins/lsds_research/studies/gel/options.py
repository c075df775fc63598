"""Options of the study `gel`."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class GelStudyOptions(BaseModel):
    """Measure every model of the simulated gel on every scene: the dots' error against the time a frame takes.

    Without --reference the finest grid stands in for the truth. Grids of the choosing model are tried on random
    scenes, and their cost, audits included, compared with the cheapest grid that would have met the tolerance.

    \b
    Examples:
      lsds study gel
      lsds study gel --scene sphere --scene pipe --random 0 --csv gel.csv
      lsds study gel --reference contact_reference --json gel.json
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    scenes: list[str] = Field(
        default_factory=list,
        description="scene to measure; repeatable, all where none is named",
        json_schema_extra={"flag": "--scene", "metavar": "NAME"},
    )
    repeats: int = Field(
        default=3,
        ge=1,
        le=100,
        description="runs of each; times are over the frames of all, cost ratios of the fastest",
    )
    reference: str = Field(
        default="",
        description="folder of reference solutions (sphere.npz, ...); else the finest grid",
        json_schema_extra={"metavar": "FOLDER"},
    )
    random: int = Field(default=12, ge=0, le=1000, description="random scenes for the choosing gel")
    seed: int = Field(default=1000, ge=0, description="of the first random scene")
