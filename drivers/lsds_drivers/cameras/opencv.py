"""Other sources that OpenCV opens: RTSP and other network streams, and video files played at their own rate."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import cv2
import numpy as np

from lsds.clock import NS_PER_S
from lsds.errors import ConnectFailed, DeviceTimeout
from lsds_drivers.cameras.jpeg import require_whole
from lsds_drivers.cameras.source import Shot


class OpenCvSource:
    """A `FrameSource` on a URL or a video file. A file ends with EOFError; its frames come when they are due."""

    def __init__(self, device: str, address: str) -> None:
        self._device = device
        self._address = address
        self._is_file = "://" not in address
        self._capture: cv2.VideoCapture | None = None
        self._stopped = threading.Event()
        self._began_ns: int | None = None

    def open(self, timeout_s: float) -> None:
        """Open it. Raises ConnectFailed."""
        if self._is_file and not Path(self._address).expanduser().is_file():
            raise ConnectFailed(self._device, f"there is no file {self._address}", remedy="check the path")
        address = str(Path(self._address).expanduser()) if self._is_file else self._address
        limits = [] if self._is_file else [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, round(timeout_s * 1e3)]
        limits += [] if self._is_file else [cv2.CAP_PROP_READ_TIMEOUT_MSEC, round(timeout_s * 1e3)]
        capture = cv2.VideoCapture(address, cv2.CAP_FFMPEG, limits) if limits else cv2.VideoCapture(address)
        if not capture.isOpened():
            capture.release()
            raise ConnectFailed(
                self._device, f"{self._address} cannot be opened", remedy="an address or a video that FFmpeg knows?"
            )
        self._capture = capture
        self._stopped.clear()

    def shot(self, timeout_s: float) -> Shot:
        """Wait for the next frame. Raises DataError, ConnectFailed, EOFError."""
        if self._capture is None:
            raise ConnectFailed(self._device, f"{self._address} is not open")
        good, data = self._capture.read()
        arrived_ns = time.monotonic_ns()
        if not good:
            if self._is_file:
                raise EOFError(f"{self._address}: the recording has ended")
            raise ConnectFailed(self._device, f"{self._address}: the stream ended")
        if self._is_file:
            arrived_ns = self._due(float(self._capture.get(cv2.CAP_PROP_POS_MSEC)) * 1e-3)
        image = np.asarray(cv2.cvtColor(data, cv2.COLOR_BGR2RGB), np.uint8)
        if not self._is_file:
            require_whole(image)
        return Shot(image, arrived_ns)

    def interrupt(self) -> None:
        """Wake a waiting `shot`."""
        self._stopped.set()

    def close(self) -> None:
        """Release it."""
        if self._capture is not None:
            self._capture.release()
            self._capture = None
            self._began_ns = None

    def _due(self, at_s: float) -> int:
        """Wait until a frame of the file is due; return its due time."""
        now = time.monotonic_ns()
        if self._began_ns is None:
            self._began_ns = now - round(at_s * NS_PER_S)
        due = self._began_ns + round(at_s * NS_PER_S)
        if self._stopped.wait(max(0, due - now) / NS_PER_S):
            raise DeviceTimeout(self._device, "reading was ended")
        return due
