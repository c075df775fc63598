"""The colour stream of a RealSense camera, or of one of its recordings, through an unmodified `rs.pipeline`."""

from __future__ import annotations

import importlib
import time
from typing import Any

import numpy as np

from lsds.errors import ConnectFailed, DeviceTimeout
from lsds_drivers.cameras.source import Shot

RECORDINGS = (".db3", ".bag")
DEFAULT_SIZE = (640, 480)
"""Width and height of the colour stream unless configured, px; chosen."""
COLOUR_RATE_HZ = 60
"""Rate of the colour stream, Hz; chosen."""
_NS_PER_MS = 1_000_000
"""Nanoseconds per millisecond; librealsense counts in milliseconds."""


class RealSenseSource:
    """A `FrameSource`. `which` is empty for the first camera, a serial number, or a recording's file.

    A recording is played at its own pace and ends with EOFError. `intrinsics` is known once it is open: (camera matrix
    (3, 3), distortion coefficients (5,)) as OpenCV has them.
    """

    def __init__(self, device: str, which: str, *, size: tuple[int, int] | None = None) -> None:
        self._device = device
        self._which = which
        self._size = size or DEFAULT_SIZE
        self._recording = which.lower().endswith(RECORDINGS)
        self._pipeline: Any = None
        self._playback: Any = None
        self._last = -1
        self.intrinsics: tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]] | None = None

    def open(self, timeout_s: float) -> None:
        """Start the pipeline. Raises ConnectFailed."""
        try:
            rs = _library()
        except ImportError as error:
            raise ConnectFailed(
                self._device,
                f"pyrealsense2 cannot be imported: {error}",
                remedy="pip install 'lsds-tactile[realsense]'; on Debian also: apt install libusb-1.0-0",
            ) from error
        config = rs.config()
        if self._recording:
            config.enable_device_from_file(self._which, False)
        else:
            self._require_device(rs)
            if self._which:
                config.enable_device(self._which)
            config.enable_stream(rs.stream.color, *self._size, rs.format.rgb8, COLOUR_RATE_HZ)
        pipeline = rs.pipeline()
        try:
            profile = pipeline.start(config)
        except RuntimeError as error:
            what = self._which or "a RealSense camera"
            raise ConnectFailed(
                self._device, f"{what}: {error}", remedy="see rs-enumerate-devices: serial number, USB 3, modes"
            ) from error
        self._pipeline = pipeline
        if self._recording:
            self._playback = profile.get_device().as_playback()
        self._last = -1
        self.intrinsics = _intrinsics(profile.get_stream(rs.stream.color).as_video_stream_profile().intrinsics)

    def shot(self, timeout_s: float) -> Shot:
        """Wait for the next colour frame. Raises DeviceTimeout, EOFError."""
        deadline = time.monotonic() + timeout_s
        while True:
            left_ms = round(max(1.0, (deadline - time.monotonic()) * 1e3))
            good, frames = self._pipeline.try_wait_for_frames(min(left_ms, 200))
            arrived_ns = time.monotonic_ns()
            colour = frames.get_color_frame() if good else None
            if colour and colour.get_frame_number() != self._last:
                return self._shot(colour, arrived_ns)
            if self._ended():
                raise EOFError(f"{self._which}: the recording has ended")
            if time.monotonic() > deadline:
                raise DeviceTimeout(self._device, f"no colour frame came for {timeout_s:.1f} s")

    def interrupt(self) -> None:
        """A `shot` waits a fifth of a second at most for each frameset, and its limit in all."""

    def close(self) -> None:
        """Stop the pipeline."""
        if self._pipeline is not None:
            try:
                self._pipeline.stop()
            except RuntimeError:
                pass  # it was not running any more
            finally:
                self._pipeline = self._playback = None

    def _require_device(self, rs: Any) -> None:
        """Raise ConnectFailed if the camera is not connected; the pipeline would wait for fifteen seconds."""
        serials = [d.get_info(rs.camera_info.serial_number) for d in rs.context().query_devices()]
        if not serials or (self._which and self._which not in serials):
            there = f"there are: {', '.join(serials)}" if serials else "none is plugged in; see rs-enumerate-devices"
            raise ConnectFailed(self._device, f"there is no RealSense {self._which or 'camera'}", remedy=there)

    def _shot(self, colour: Any, arrived_ns: int) -> Shot:
        rs = _library()
        self._last = colour.get_frame_number()
        pixels = np.asanyarray(colour.get_data())
        layout = colour.get_profile().format()
        image = pixels[..., ::-1] if layout == rs.format.bgr8 else pixels
        # Copied, because the library reuses the frame's memory.
        picture = np.array(image, np.uint8, order="C")
        return Shot(picture, arrived_ns, None if self._recording else _stamp(rs, colour), self._last)

    def _ended(self) -> bool:
        rs = _library()
        return self._playback is not None and self._playback.current_status() == rs.playback_status.stopped


def _library() -> Any:
    return importlib.import_module("pyrealsense2")


def _stamp(rs: Any, frame: Any) -> int | None:
    """Return the frame's time stamp on the monotonic clock, if it uses a clock of this machine.

    The library's global and system times count wall-clock milliseconds, which are converted with the present difference
    of the two clocks. Its hardware clock starts with the camera and cannot be used.
    """
    if frame.get_frame_timestamp_domain() == rs.timestamp_domain.hardware_clock:
        return None
    return round(float(frame.get_timestamp()) * _NS_PER_MS) - time.time_ns() + time.monotonic_ns()


def _intrinsics(found: Any) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    matrix = np.array([[found.fx, 0.0, found.ppx], [0.0, found.fy, found.ppy], [0.0, 0.0, 1.0]])
    return matrix, np.array(found.coeffs, np.float64)
