"""Sensor `gelsight-mini`: the GelSight Mini on USB, or anything that streams its picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import Field

from lsds.contracts import SensorSpec
from lsds_drivers.cameras.address import make_source
from lsds_drivers.cameras.options import DotCount, StreamOptions
from lsds_drivers.cameras.picture import Crop, Picture
from lsds_drivers.cameras.tactile import CameraSensor

if TYPE_CHECKING:
    from lsds.contracts import BuildContext

NAME = "gelsight-mini"


class GelSightMiniOptions(StreamOptions):
    """Options of `[sensor.gelsight-mini]`."""

    camera: str = Field(
        default="GelSight", description="camera index, /dev path, part of the USB name, http:// stream or named pipe"
    )
    width: int = Field(default=320, ge=32, le=4096, description="width of the resulting image, px")
    height: int = Field(default=240, ge=32, le=4096, description="height of the resulting image, px")
    border: float = Field(
        default=0.15, ge=0, le=0.45, description="fraction cropped on each side; 0 for a stream that is already cropped"
    )
    rate_hz: float = Field(
        default=25.0, gt=0, le=240, description="nominal frame rate; frame times are always measured"
    )
    mm_per_px: float = Field(
        default=0.0625, gt=0, le=1, description="scale of the resulting image; published values are 0.058-0.071"
    )
    # A TOML array is a list, which strict tuples refuse.
    pad: tuple[DotCount, DotCount] | None = Field(
        default=(7, 9), strict=False, description="printed markers, [rows, columns]"
    )
    dots: bool = Field(default=True, description="false for a gel without markers; pad is then ignored")


def build(options: GelSightMiniOptions, context: BuildContext) -> CameraSensor:
    """Factory of the sensor `gelsight-mini`. Opens nothing."""
    picture = Picture(options.width, options.height, Crop(border=options.border))
    pad = options.pad if options.dots else None
    spec = SensorSpec(options.width, options.height, options.rate_hz, options.mm_per_px * 1e-3, pad)
    source = make_source(NAME, options.camera, picture.reduction)
    return CameraSensor(NAME, source, picture, spec, options, context)
