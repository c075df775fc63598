"""Options of the study `gel`."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class GelStudyOptions(BaseModel):
    """What `lsds chart gel` measures."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    scenes: list[str] = Field(default_factory=list, description="scenes to measure; all where none is named")
    repeats: int = Field(
        default=3,
        ge=1,
        le=100,
        description="runs of each; times are over the frames of all, cost ratios of the fastest",
    )
    reference: str = Field(
        default="", description="folder of reference solutions (sphere.npz, ...); else the finest grid"
    )
    random: int = Field(default=12, ge=0, le=1000, description="random scenes for the choosing gel")
    seed: int = Field(default=1000, ge=0, description="of the first random scene")
