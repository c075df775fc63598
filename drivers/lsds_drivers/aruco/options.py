"""Options of the pose source `aruco`: the camera, its calibration, and which marker is on which body."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from lsds_drivers.cameras.options import StreamOptions


class MarkerOptions(BaseModel):
    """One printed marker."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    id: int = Field(ge=0, le=100_000, description="id of the marker in the dictionary")
    body: str = Field(min_length=1, description="body that the marker is attached to; several markers may share a body")
    size_mm: float = Field(gt=1, le=5000, description="side length of its black square")
    x_mm: float = Field(default=0.0, description="x of its centre in the body's plane, to the right")
    y_mm: float = Field(default=0.0, description="y of its centre in the body's plane, upward")


class BoardOptions(BaseModel):
    """One printed ChArUco board."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    body: str = Field(min_length=1, description="body that the board is attached to")
    columns: int = Field(ge=2, le=100, description="number of columns of squares")
    rows: int = Field(ge=2, le=100, description="number of rows of squares")
    square_mm: float = Field(gt=1, le=5000, description="side length of a square")
    marker_mm: float = Field(gt=0.5, le=5000, description="side length of a marker's black square")
    first_id: int = Field(default=0, ge=0, le=100_000, description="id of its first marker")
    legacy: bool = Field(default=False, description="printed by OpenCV before 4.6, with an even number of rows")


class ArucoOptions(StreamOptions):
    """Options of `[pose_source.aruco]`."""

    camera: str = Field(
        default="0",
        description="camera index, /dev path, part of the USB name, URL, video file, named pipe or realsense[:X]",
    )
    calibration: str = Field(
        default="", description="calibration file of `lsds calibrate camera` or OpenCV; a RealSense has its own"
    )
    capture_width: int = Field(default=640, ge=16, le=8192, description="width requested from the camera, px")
    capture_height: int = Field(default=480, ge=16, le=8192, description="height requested from the camera, px")
    dictionary: str = Field(default="4X4_50", description="OpenCV name of the dictionary of all markers and boards")
    markers: list[MarkerOptions] = Field(default_factory=list, description="markers and their bodies")
    boards: list[BoardOptions] = Field(default_factory=list, description="ChArUco boards")
    max_error_px: float = Field(
        default=2.0, gt=0, le=50, description="maximum reprojection error of a pose; worse fits are rejected"
    )
    camera_position_m: list[float] = Field(
        default=[0.0, 0.0, 0.0], min_length=3, max_length=3, description="base <- camera; x right, y down, z forward"
    )
    camera_quaternion_xyzw: list[float] = Field(
        default=[0.0, 0.0, 0.0, 1.0], min_length=4, max_length=4, description="base <- camera; normalised on use"
    )
