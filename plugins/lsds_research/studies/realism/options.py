"""Options of the study `realism`."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class RealismOptions(BaseModel):
    """Compare simulated clips with real recordings: the same tracker and features, quantiles side by side.

    In the simulated clips a hand grasps an object of the catalogue, lifts and shakes it, and it slips or holds.

    \b
    Examples:
      lsds study realism --recordings videos
      lsds study realism --recordings videos --videos 20 --clips 21 --plot quick.png
      lsds study realism --recordings videos --csv realism.csv --json realism.json
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    recordings: str = Field(
        description="folder of real recordings (videos), searched recursively", json_schema_extra={"metavar": "FOLDER"}
    )
    videos: int = Field(default=0, ge=0, description="number of recordings to use, evenly spaced; 0: all")
    clips: int = Field(default=63, ge=1, le=10_000, description="number of simulated clips")
    plain: int = Field(
        default=21, ge=0, le=10_000, description="number of those that are also simulated without the fine relief"
    )
    seed: int = Field(default=0, ge=0, description="seed of the simulated clips")

    fidelity: Literal["auto", "winkler", "layer", "pad"] = Field(default="pad", description="model of the gel")
    grid: Literal[1, 2, 4] = Field(default=1, description="gel cells per 0.96 mm in each direction, for layer and pad")
    step_ms: float = Field(default=4.0, ge=0.25, le=10, description="time step of the physics")
    rate_hz: float = Field(default=25.0, ge=1, le=120, description="frame rate of the simulated camera")
    least_frames: int = Field(default=60, ge=4, le=1000, description="length of the shortest clip, frames")
    most_frames: int = Field(default=120, ge=4, le=1000, description="length of the longest clip, frames")
    codec: Literal["XVID", "FFV1"] = Field(
        default="XVID", description="codec of the simulated clips: that of the recordings, or a lossless one"
    )
