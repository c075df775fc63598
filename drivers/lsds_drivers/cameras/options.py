"""Options common to all camera drivers."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from lsds_drivers.cameras.times import StampPolicy

DotCount = Annotated[int, Field(strict=True, ge=1, le=100)]
"""Rows or columns of a printed pad."""


class StreamOptions(BaseModel):
    """How a camera is opened and how long it may be silent."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    connect_timeout_s: float = Field(
        default=5.0, gt=0, le=60, description="time limit for opening the camera and receiving the first frame"
    )
    stale_after_ms: float = Field(
        default=0.0,
        ge=0,
        le=60_000,
        description="age above which a frame is StaleData; 0: five measured intervals, at least 500 ms",
    )
    still_after_ms: float = Field(
        default=1000.0, ge=0, le=600_000, description="time after which a repeated image is StaleData; 0: never"
    )
    skip_frames: int = Field(
        default=3, ge=0, le=500, description="number of dark first frames to discard after opening"
    )
    stamps: StampPolicy = Field(
        default="auto",
        description="auto: the device's time stamp if it uses this machine's clock; arrival: time of the first byte",
    )
    delay_ms: float = Field(
        default=0.0,
        ge=0,
        le=1000,
        description="known delay from exposure to time stamp, subtracted from each time stamp",
    )
