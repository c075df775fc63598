"""Sensor `uvc-tactile`: any other camera-based fingertip, with or without markers, described by its options."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from pydantic import Field

from lsds.contracts import SensorSpec
from lsds_drivers.cameras.address import make_source
from lsds_drivers.cameras.options import DotCount, StreamOptions
from lsds_drivers.cameras.picture import Crop, Flip, Picture, Turn
from lsds_drivers.cameras.tactile import CameraSensor

if TYPE_CHECKING:
    from lsds.contracts import BuildContext

NAME = "uvc-tactile"


class UvcTactileOptions(StreamOptions):
    """Options of `[sensor.uvc-tactile]`. The defaults use the whole picture and describe a DIGIT."""

    camera: str = Field(
        default="DIGIT", description="camera index, /dev path, part of the USB name, http:// stream or named pipe"
    )
    capture_width: int = Field(default=640, ge=16, le=8192, description="width requested from the camera, px")
    capture_height: int = Field(default=480, ge=16, le=8192, description="height requested from the camera, px")
    border: float = Field(default=0.0, ge=0, le=0.45, description="fraction cropped on each side")
    cut_left: int = Field(default=0, ge=0, le=8192, description="px cropped on the left, after border")
    cut_top: int = Field(default=0, ge=0, le=8192, description="px cropped at the top")
    cut_right: int = Field(default=0, ge=0, le=8192, description="px cropped on the right")
    cut_bottom: int = Field(default=0, ge=0, le=8192, description="px cropped at the bottom")
    turn: Literal[0, 90, 180, 270] = Field(default=270, description="rotation clockwise in degrees, after cropping")
    flip: Flip = Field(default="none", description="mirroring, after the rotation: none, horizontal, vertical or both")
    swap_red_blue: bool = Field(default=False, description="swap red and blue, for cameras that deliver BGR as RGB")
    width: int = Field(default=240, ge=32, le=4096, description="width of the resulting image, px")
    height: int = Field(default=320, ge=32, le=4096, description="height of the resulting image, px")
    rate_hz: float = Field(
        default=30.0, gt=0, le=240, description="nominal frame rate; frame times are always measured"
    )
    mm_per_px: float = Field(default=0.06, gt=0, le=1, description="scale of the resulting image, to be measured")
    # A TOML array is a list, which strict tuples refuse.
    pad: tuple[DotCount, DotCount] | None = Field(
        default=None, strict=False, description="printed markers, [rows, columns]; leave out for a gel without markers"
    )


def build(options: UvcTactileOptions, context: BuildContext) -> CameraSensor:
    """Factory of the sensor `uvc-tactile`. Opens nothing."""
    crop = Crop(options.border, options.cut_left, options.cut_top, options.cut_right, options.cut_bottom)
    turn: Turn = options.turn
    picture = Picture(options.width, options.height, crop, turn, options.flip, options.swap_red_blue)
    spec = SensorSpec(options.width, options.height, options.rate_hz, options.mm_per_px * 1e-3, options.pad)
    size = (options.capture_width, options.capture_height)
    source = make_source(NAME, options.camera, picture.reduction, size=size)
    return CameraSensor(NAME, source, picture, spec, options, context)
