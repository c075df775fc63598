"""Options of the study `gel`."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class GelStudyOptions(BaseModel):
    """Measure every model of the simulated gel on every scene: the dots' error against the time a frame takes.

    Without --reference the finest grid is the reference. Grids of the automatic model are tried on random
    scenes, and their cost, audits included, compared with the cheapest grid that would have met the tolerance.

    Takes: several minutes.

    \b
    Examples:
      lsds study gel
      lsds study gel --scene sphere --scene pipe --random 0 --csv gel.csv
      lsds study gel --reference contact_reference --json gel.json
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    scenes: list[str] = Field(
        default_factory=list,
        description="scene to measure; repeatable; default: all",
        json_schema_extra={"flag": "--scene", "metavar": "NAME"},
    )
    repeats: int = Field(
        default=3,
        ge=1,
        le=100,
        description="runs of each; times are over the frames of all runs, cost ratios use the fastest run",
    )
    reference: str = Field(
        default="",
        description="folder of reference solutions (sphere.npz, ...); default: solve on the finest grid",
        json_schema_extra={"metavar": "FOLDER"},
    )
    random: int = Field(
        default=12, ge=0, le=1000, description="number of random scenes for the gel with automatic grid"
    )
    seed: int = Field(default=1000, ge=0, description="seed of the first random scene")
