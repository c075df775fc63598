"""The camera of a DIGIT, by OpenCV."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import cv2
import numpy as np
from lsds.clock import Clock
from lsds.errors import ConnectFailed, ConnectionLost

from lsds_digit.find import BY_ID, device_file
from lsds_digit.modes import BRIGHTEST, STREAMS, led_value

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_digit.options import Options

OLDEST_STAMP_NS = 1_000_000_000
"""Age (ns) from which a time stamp of the kernel belongs to another clock."""


class Shot(NamedTuple):
    """One upright image, uint8 RGB, and the time of its exposure."""

    image: NDArray[np.uint8]
    t_ns: int


def open_capture(path: str) -> Any:
    """Return OpenCV's capture of a device file. Tests replace it by a fake."""
    return cv2.VideoCapture(path, cv2.CAP_V4L2)


def upright(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the camera's BGR picture as a new upright RGB image: the camera is mounted on its side."""
    turned = cv2.rotate(picture, cv2.ROTATE_90_COUNTERCLOCKWISE)
    return np.asarray(cv2.cvtColor(turned, cv2.COLOR_BGR2RGB), np.uint8)


class Camera:
    """A DIGIT that one thread opens, reads and closes; it can be opened again."""

    def __init__(self, device: str, options: Options, clock: Clock, folder: Path = BY_ID) -> None:
        self._device = device
        self._options = options
        self._clock = clock
        self._folder = folder
        self._path = ""
        self._capture: Any = None

    def open(self) -> None:
        """Open the device file in the stream mode, and switch the light on. Raises ConnectFailed."""
        options = self._options
        self._path = device_file(self._device, options.serial, options.index, self._folder)
        self._capture = capture = open_capture(self._path)
        if not capture.isOpened():
            self.close()
            remedy = f"end the program that uses it: fuser -v {self._path}"
            raise ConnectFailed(self._device, f"{self._path} does not open", remedy=remedy)
        stream = STREAMS[options.mode]
        capture.set(cv2.CAP_PROP_FRAME_WIDTH, stream.width_px)
        capture.set(cv2.CAP_PROP_FRAME_HEIGHT, stream.height_px)
        # The size resets the rate, so the rate comes after it.
        capture.set(cv2.CAP_PROP_FPS, stream.rate_hz)
        # A queue would delay every frame by its length.
        capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
        wanted = BRIGHTEST if options.intensity is None else options.intensity
        lit = capture.set(cv2.CAP_PROP_ZOOM, led_value(wanted))
        if not lit and options.intensity is not None:
            self.close()
            remedy = "leave intensity out, or update the firmware to revision 200 or later"
            raise ConnectFailed(self._device, f"{self._path} does not set the LED intensity", remedy=remedy)

    def shot(self) -> Shot:
        """Wait for the next image. Raises ConnectionLost, or ConnectFailed for a picture of another size."""
        good, picture = self._capture.read()
        arrived_ns = self._clock.now()
        if not good or picture is None:
            raise ConnectionLost(self._device, f"{self._path} sends no frames", remedy="check the cable and the port")
        stream = STREAMS[self._options.mode]
        if picture.shape != (stream.height_px, stream.width_px, 3):
            problem = f"{self._path} sends {picture.shape[1]} x {picture.shape[0]} px"
            remedy = f"{self._options.mode} has {stream.width_px} x {stream.height_px}; check that it is a DIGIT"
            raise ConnectFailed(self._device, problem, remedy=remedy)
        # The kernel stamps the first packet of a frame on the monotonic clock, if the driver supports it.
        stamp_ns = round(self._capture.get(cv2.CAP_PROP_POS_MSEC) * 1e6)
        plausible = 0 <= arrived_ns - stamp_ns <= OLDEST_STAMP_NS
        return Shot(upright(picture), stamp_ns if plausible else arrived_ns)

    def close(self) -> None:
        """Release the device file. A second call does nothing."""
        capture, self._capture = self._capture, None
        if capture is not None:
            capture.release()
