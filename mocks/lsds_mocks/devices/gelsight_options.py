"""Options of the mock GelSight Mini."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class GelSightOptions(BaseModel):
    """Options of `[sensor.mock-gelsight-mini]`. Ranges in the descriptions are what public recordings show."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    finger: Literal["left", "right"] = Field(
        default="left", description="finger that carries the sensor; right sees the same gel mirrored left to right"
    )
    optics: Literal["markers", "linear", "full"] = Field(
        default="linear", description="colour: dots alone; linear in the surface's slope; its normals (slopes over 0.4)"
    )
    gel: int | None = Field(
        default=None,
        ge=0,
        description="number of a gel with its own pitch, dots, brightness and wear; none: the mean one",
    )
    pad: Literal["7x9", "8x10", "5x7", "none"] = Field(default="7x9", description="printed dots, rows x columns")
    mm_per_px: float = Field(default=0.0625, gt=0.02, le=0.2, description="scale; 0.058-0.071 are published")
    dot_diameter_px: float = Field(default=13.0, ge=4, le=25, description="dot diameter; 11.6-17.3 by gel")
    dot_core: float = Field(default=0.31, ge=0, le=1, description="dot brightness over background; 0.28-0.35")
    dot_blur_px: float = Field(default=0.9, ge=0.3, le=4, description="Gaussian blur of the dots' edge")
    gel_variation: float = Field(default=1.0, ge=0, le=5, description="how much this gel differs from the mean one")
    brightness: float = Field(default=1.0, ge=0.2, le=2, description="background over the mean gel's; 0.9-1.2")
    wear: float = Field(default=0.0, ge=0, le=1, description="share of dots that have lost ink; specks of dust")
    contact_lift_levels: float = Field(
        default=0.0, ge=0, le=20, description="how much brighter the gel is where it is pressed; 3-9 were seen on one"
    )
    noise: float = Field(default=1.0, ge=0, le=20, description="camera noise, 1 = sigma 2.0/1.1/2.0 in R/G/B")
    drift: float = Field(default=1.0, ge=0, le=50, description="slow brightness drift, 1 = 0.3 levels")
    swing_levels: float = Field(default=0.0, ge=0, le=60, description="fast brightness swings; up to 30 occur")
    dim_start: bool = Field(default=True, description="first frames dim and red, settled by the third")

    rate_hz: float = Field(default=25.0, gt=0.5, le=120, description="nominal frame rate; many hosts see 18-19")
    jitter_ms: float = Field(default=1.5, ge=0, le=10, description="standard deviation of the exposure time")
    latency_ms: float = Field(default=25.0, ge=10, le=500, description="from exposure to a readable frame")
    latency_jitter_ms: float = Field(default=2.0, ge=0, le=50, description="mean of the latency's tail")
    first_frame_ms: float = Field(default=100.0, ge=0, le=10000, description="from connect to the first exposure")
    stale_after_ms: float = Field(default=1000.0, gt=0, description="older frames are reported as StaleData")
    drop_probability: float = Field(default=0.0, ge=0, le=1, description="frames lost on the way (gaps in seq)")
    duplicate_probability: float = Field(default=0.0, ge=0, le=1, description="frames that repeat the one before")
    freeze_at_s: float | None = Field(default=None, ge=0, description="fault: the image stands still from then on")
    silent_at_s: float | None = Field(default=None, ge=0, description="fault: no frame arrives from then on")
