"""Options that every camera driver has."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from lsds_drivers.cameras.times import StampPolicy

DotCount = Annotated[int, Field(strict=True, ge=1, le=100)]
"""Rows or columns of a printed pad."""


class StreamOptions(BaseModel):
    """How a camera is opened and how long it may be silent."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    connect_timeout_s: float = Field(default=5.0, gt=0, le=60, description="to open and to show a first picture")
    stale_after_ms: float = Field(
        default=0.0,
        ge=0,
        le=60_000,
        description="an older frame is StaleData; 0: five measured intervals, at least 500",
    )
    still_after_ms: float = Field(
        default=1000.0, ge=0, le=600_000, description="a picture that repeats for longer is StaleData; 0: never"
    )
    skip_frames: int = Field(default=3, ge=0, le=500, description="dark first frames discarded after each opening")
    stamps: StampPolicy = Field(
        default="auto", description="auto: the device's own where on this machine's clock; arrival: of the first byte"
    )
    delay_ms: float = Field(
        default=0.0, ge=0, le=1000, description="known delay from exposure to stamp, taken off each time"
    )
