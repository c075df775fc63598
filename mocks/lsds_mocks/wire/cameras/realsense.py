"""RealSense recordings of rendered pictures, which an unmodified `rs.pipeline` plays back like a camera."""

from __future__ import annotations

import importlib
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.errors import ConnectFailed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.calibration.vision.camera import CameraModel

DEPTH_M = 0.45
"""Constant depth in the depth stream, which a recording must have but no code here uses."""
_DEPTH_UNIT_M = 0.001
"""Depth of one count, m: the default of librealsense."""
_COLOUR_ID = 1
"""Unique number of the colour stream; chosen."""
_DEPTH_ID = 2
"""Unique number of the depth stream; chosen."""


def record(
    mock: str,
    path: str,
    camera: CameraModel,
    rate_hz: float,
    pictures: Iterable[tuple[int, NDArray[np.uint8] | None]],
) -> int:
    """Write (t_ns, uint8 RGB image) pairs as a colour stream with a flat depth stream; return the number of frames.

    Raises ConnectFailed if pyrealsense2 cannot be imported or cannot write the file, whose name must end in .db3.
    """
    try:
        rs: Any = importlib.import_module("pyrealsense2")
    except ImportError as error:
        raise ConnectFailed(
            mock,
            f"pyrealsense2 cannot be imported: {error}",
            remedy="pip install 'lsds-tactile[realsense]'; on Debian also: apt install libusb-1.0-0",
        ) from error
    if not path.endswith(".db3"):
        raise ConnectFailed(mock, f"{path}: a recording's name ends in .db3", remedy="other names are not played back")
    try:
        return _record(rs, path, camera, round(rate_hz), pictures)
    except RuntimeError as error:
        raise ConnectFailed(mock, f"{path}: {error}", remedy="is its folder there, and writable?") from error


def _record(
    rs: Any, path: str, camera: CameraModel, rate_hz: int, pictures: Iterable[tuple[int, NDArray[np.uint8] | None]]
) -> int:
    device = rs.software_device()
    colour = device.add_sensor("Colour")
    depth = device.add_sensor("Depth")
    colour_profile = colour.add_video_stream(_stream(rs, camera, rate_hz, colour=True))
    depth_profile = depth.add_video_stream(_stream(rs, camera, rate_hz, colour=False))
    depth.add_read_only_option(rs.option.depth_units, _DEPTH_UNIT_M)
    depth_profile.register_extrinsics_to(colour_profile, _identity(rs))
    recorder = rs.recorder(path, device)
    sensors = recorder.query_sensors()
    queue = rs.frame_queue(4)
    for sensor, profile in zip(sensors, (colour_profile, depth_profile), strict=True):
        sensor.open(profile)
        sensor.start(queue)
    width, height = camera.size
    flat = np.full((height, width), round(DEPTH_M / _DEPTH_UNIT_M), np.uint16)
    kept: list[NDArray[Any]] = []  # the library reads a frame's memory some time after it accepts the frame
    count = 0
    for t_ns, image in pictures:
        if image is None:
            continue
        pixels = np.ascontiguousarray(image)
        kept.append(pixels)
        for sensor, profile, data, size in ((colour, colour_profile, pixels, 3), (depth, depth_profile, flat, 2)):
            frame = rs.software_video_frame()
            frame.pixels = data
            frame.bpp, frame.stride = size, size * width
            frame.timestamp = t_ns * 1e-6
            frame.domain = rs.timestamp_domain.system_time
            frame.frame_number = count
            frame.profile = profile.as_video_stream_profile()
            if size == 2:
                frame.depth_units = _DEPTH_UNIT_M
            sensor.on_video_frame(frame)
        count += 1
    for sensor in sensors:
        sensor.stop()
        sensor.close()
    del recorder  # finishes the file
    return count


def _stream(rs: Any, camera: CameraModel, rate_hz: int, *, colour: bool) -> Any:
    width, height = camera.size
    intrinsics = rs.intrinsics()
    intrinsics.width, intrinsics.height = width, height
    intrinsics.fx, intrinsics.fy = float(camera.matrix[0, 0]), float(camera.matrix[1, 1])
    intrinsics.ppx, intrinsics.ppy = float(camera.matrix[0, 2]), float(camera.matrix[1, 2])
    intrinsics.model = rs.distortion.brown_conrady
    intrinsics.coeffs = camera.distortion.tolist()
    stream = rs.video_stream()
    stream.type = rs.stream.color if colour else rs.stream.depth
    stream.index = 0
    stream.uid = _COLOUR_ID if colour else _DEPTH_ID
    stream.width, stream.height, stream.fps = width, height, rate_hz
    stream.bpp = 3 if colour else 2
    stream.fmt = rs.format.rgb8 if colour else rs.format.z16
    stream.intrinsics = intrinsics
    return stream


def _identity(rs: Any) -> Any:
    same = rs.extrinsics()
    same.rotation = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    same.translation = [0.0, 0.0, 0.0]
    return same
