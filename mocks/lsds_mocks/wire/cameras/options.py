"""Options of the camera mocks: tactile camera and ground-truth camera."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from lsds_mocks.optics.pad import HEIGHT_PX, WIDTH_PX
from lsds_mocks.wire.mjpeg.options import CameraOptions

Happening = Literal["rest", "slide", "hold"]
"""Scripted scenes: gel at rest; a pipe that slides while it is lifted; a pipe that is held while it is lifted."""


class GelSightMiniOptions(CameraOptions):
    """Options of `lsds mock gelsight-mini`."""

    width: int = Field(default=640, ge=WIDTH_PX, le=4096, description="width in px; 320 x 240 is sent as rendered")
    height: int = Field(default=480, ge=HEIGHT_PX, le=4096, description="height in px; larger ones have the border")
    scene: Happening = Field(default="rest", description="scene: rest, slide (a pipe), hold")
    speed_mm_s: float = Field(default=10.0, ge=0, le=100, description="how fast the arm lifts in 'slide' and 'hold'")
    finger: Literal["left", "right"] = Field(
        default="left", description="finger that carries the sensor; right sees a mirrored image"
    )
    optics: Literal["markers", "linear", "full"] = Field(default="linear", description="optical model of the colours")
    gel: int | None = Field(default=None, ge=0, description="number of a gel with its own markers, brightness and wear")
    pad: Literal["7x9", "8x10", "5x7", "none"] = Field(default="7x9", description="printed markers, rows x columns")
    noise: float = Field(default=1.0, ge=0, le=20, description="camera noise, 1 = sigma 2.0/1.1/2.0 in R/G/B")
    dim_start: bool = Field(default=True, description="first two frames of a stream are dim and red")


class TruthCameraOptions(CameraOptions):
    """Options of `lsds mock truth-camera`."""

    port: int = Field(default=8081, ge=0, le=65535, description="TCP port; 0 takes a free one")
    rate_hz: float = Field(default=60.0, gt=0.5, le=240, description="exposures per second, on absolute deadlines")
    width: int = Field(default=640, ge=160, le=3840, description="width in px")
    height: int = Field(default=480, ge=120, le=2160, description="height in px; 1280 x 720 is cropped above and below")
    exposure_ms: float = Field(default=4.0, ge=0, le=16, description="exposure time, which causes motion blur")
    noise: float = Field(default=1.0, ge=0, le=20, description="camera noise, 1 = sigma 1.6 grey levels")
    scene: Happening = Field(default="slide", description="scene: rest, slide (the pipe lags behind), hold")
    speed_mm_s: float = Field(default=38.0, ge=0, le=100, description="how fast the arm lifts in 'slide' and 'hold'")
    calibration: str = Field(default="", description="write the camera's calibration to this .yaml or .json file")
    record: str = Field(default="", description="write a RealSense recording to this .db3 file before serving")
    record_s: float = Field(default=5.0, gt=0, le=60, description="duration of that recording")
