"""Options of the mock GelSight Mini."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class GelSightOptions(BaseModel):
    """Options of `[sensor.mock-gelsight-mini]`. Ranges in the descriptions are what public recordings show."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    finger: Literal["left", "right"] = Field(
        default="left", description="finger that carries the sensor; right sees an image mirrored left to right"
    )
    optics: Literal["markers", "linear", "full"] = Field(
        default="linear",
        description="optical model: markers only; linear in surface slope; full, by normals (slopes over 0.4)",
    )
    gel: int | None = Field(
        default=None,
        ge=0,
        description="number of a gel with its own pitch, markers, brightness and wear; default: the mean gel",
    )
    pad: Literal["7x9", "8x10", "5x7", "none"] = Field(default="7x9", description="printed markers, rows x columns")
    mm_per_px: float = Field(
        default=0.0625, gt=0.02, le=0.2, description="scale of the image; published values are 0.058-0.071"
    )
    dot_diameter_px: float = Field(default=13.0, ge=4, le=25, description="marker diameter; 11.6-17.3 by gel")
    dot_core: float = Field(default=0.31, ge=0, le=1, description="ratio of marker to background brightness; 0.28-0.35")
    dot_blur_px: float = Field(default=0.9, ge=0.3, le=4, description="Gaussian blur of the markers' edge")
    gel_variation: float = Field(
        default=1.0, ge=0, le=5, description="scale of this gel's difference from the mean gel"
    )
    brightness: float = Field(
        default=1.0, ge=0.2, le=2, description="ratio of background brightness to that of the mean gel; 0.9-1.2"
    )
    wear: float = Field(
        default=0.0, ge=0, le=1, description="fraction of markers that have lost ink; also specks of dust"
    )
    contact_lift_levels: float = Field(
        default=0.0, ge=0, le=20, description="increase of brightness in the contact patch; 3-9 measured on one gel"
    )
    noise: float = Field(default=1.0, ge=0, le=20, description="camera noise, 1 = sigma 2.0/1.1/2.0 in R/G/B")
    drift: float = Field(default=1.0, ge=0, le=50, description="slow brightness drift, 1 = 0.3 levels")
    swing_levels: float = Field(
        default=0.0, ge=0, le=60, description="amplitude of fast brightness changes; up to 30 occur"
    )
    dim_start: bool = Field(default=True, description="first two frames are dim and red")

    rate_hz: float = Field(default=25.0, gt=0.5, le=120, description="nominal frame rate; many hosts receive 18-19")
    jitter_ms: float = Field(
        default=1.5,
        ge=0,
        le=100,
        description="standard deviation of the exposure time; cut off at 0.3 of the interval: order is kept",
    )
    latency_ms: float = Field(default=25.0, ge=10, le=500, description="latency from exposure to a readable frame")
    latency_jitter_ms: float = Field(default=2.0, ge=0, le=50, description="mean of the latency's tail")
    first_frame_ms: float = Field(default=100.0, ge=0, le=10000, description="time from connect to the first exposure")
    stale_after_ms: float = Field(default=1000.0, gt=0, description="age above which a frame is StaleData")
    drop_probability: float = Field(
        default=0.0, ge=0, le=1, description="probability that a frame is lost (a gap in seq)"
    )
    duplicate_probability: float = Field(
        default=0.0, ge=0, le=1, description="probability that a frame repeats the previous one"
    )
    freeze_at_s: float | None = Field(
        default=None, ge=0, description="fault: time after which the image no longer changes"
    )
    silent_at_s: float | None = Field(default=None, ge=0, description="fault: time after which no frame arrives")
