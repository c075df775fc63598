"""Options of `[sensor.digit]` and `[sensor.mock-digit]`."""

from __future__ import annotations

from typing import Annotated

from lsds.contracts import SensorSpec
from pydantic import BaseModel, ConfigDict, Field, model_validator

from lsds_digit.modes import BRIGHTEST, FIELD_MM, STREAMS, Mode

Count = Annotated[int, Field(strict=True, ge=2, le=100)]
"""Rows or columns of printed markers."""


class MockOptions(BaseModel):
    """The image, for the sensor in the simulated cell."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    mode: Mode = Field(default="qvga", description="qvga: 240 x 320 px at 60 Hz; vga: 480 x 640 px at 30 Hz")
    field_mm: float = Field(
        default=FIELD_MM, gt=1, le=100, description="length of gel along the long side of the image, to be measured"
    )

    def spec(self, pad: tuple[int, int] | None = None) -> SensorSpec:
        """Return the spec of the upright image."""
        stream = STREAMS[self.mode]
        metres_per_px = self.field_mm * 1e-3 / stream.width_px
        return SensorSpec(stream.height_px, stream.width_px, stream.rate_hz, metres_per_px, pad)


class Options(MockOptions):
    """Which DIGIT to open, its light and its markers."""

    serial: str = Field(default="", description="serial number, such as D20790; empty: the only DIGIT, or index")
    index: int | None = Field(default=None, ge=0, le=255, description="N of /dev/videoN, instead of serial")
    intensity: int | None = Field(
        default=None, ge=0, le=BRIGHTEST, description="LED intensity; leave out for full light if the camera allows it"
    )
    # A TOML array is a list, which strict tuples refuse.
    pad: tuple[Count, Count] | None = Field(
        default=None, strict=False, description="printed markers, [rows, columns]; leave out for a gel without markers"
    )
    connect_timeout_s: float = Field(default=5.0, gt=0, le=60, description="time allowed for the first frame")
    stale_after_ms: float = Field(default=500.0, ge=50, le=60_000, description="age at which the newest frame is stale")

    @model_validator(mode="after")
    def _one_name(self) -> Options:
        if self.serial and self.index is not None:
            raise ValueError("serial and index both name the camera; leave one out")
        return self
