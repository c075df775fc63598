"""JPEG after JPEG through a named pipe, as `lsds mock gelsight-mini --pipe` and `ffmpeg -f mjpeg` write it."""

from __future__ import annotations

import os
import select
import threading
import time

from lsds.errors import ConnectFailed, DataError, DeviceTimeout, ProtocolFault
from lsds_drivers.cameras.jpeg import START, decode, end_of
from lsds_drivers.cameras.source import Reduction, Shot, whole

LONGEST_PICTURE = 64 * 1024 * 1024
"""Maximum length of a picture, bytes; chosen above any JPEG picture."""


class PipeSource:
    """A `FrameSource` on a named pipe. There are no stamps in it: a picture's time is that of its first byte."""

    def __init__(self, device: str, path: str, reduction: Reduction = whole) -> None:
        self._device = device
        self._path = path
        self._reduction = reduction
        self._pipe: int | None = None
        self._wake: tuple[int, int] | None = None
        self._lock = threading.Lock()
        self._data = bytearray()
        self._began_ns = 0

    def open(self, timeout_s: float) -> None:
        """Open the pipe for reading; does not wait for a writer. Raises ConnectFailed."""
        try:
            self._pipe = os.open(self._path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise ConnectFailed(
                self._device, f"{self._path}: {error.strerror}", remedy="start what writes into the pipe first"
            ) from error
        self._wake = os.pipe2(os.O_NONBLOCK)
        self._data.clear()

    def shot(self, timeout_s: float) -> Shot:
        """Wait for the next picture. Raises DataError, DeviceTimeout, ConnectFailed."""
        deadline = time.monotonic() + timeout_s
        while True:
            end = self._end()
            if end is None and time.monotonic() > deadline:
                raise DeviceTimeout(self._device, f"{self._path}: no picture for {timeout_s:.1f} s: who writes?")
            if end is not None:
                jpeg, began_ns = bytes(self._data[:end]), self._began_ns
                del self._data[:end]
                self._began_ns = time.monotonic_ns()
                return Shot(decode(jpeg, self._reduction), began_ns)
            self._fill(deadline)

    def interrupt(self) -> None:
        """Wake a `shot` that waits."""
        with self._lock:  # a descriptor that was closed in between may already be reused
            if self._wake is not None:
                os.write(self._wake[1], b"x")

    def close(self) -> None:
        """Close the pipe."""
        with self._lock:
            for descriptor in (self._pipe, *(self._wake or ())):
                if descriptor is not None:
                    os.close(descriptor)
            self._pipe = self._wake = None

    def _end(self) -> int | None:
        try:
            return end_of(self._data)
        except DataError:
            begin = self._data.find(START, 1)
            del self._data[: begin if begin >= 0 else len(self._data)]
            raise

    def _fill(self, deadline: float) -> None:
        if self._pipe is None or self._wake is None:
            raise ConnectFailed(self._device, f"{self._path} is not open")
        left = deadline - time.monotonic()
        readable, _, _ = select.select([self._pipe, self._wake[0]], [], [], max(0.0, left))
        if self._wake[0] in readable:
            raise ConnectFailed(self._device, f"{self._path}: reading was ended")
        if not readable:
            return
        if not self._data:
            self._began_ns = time.monotonic_ns()
        data = os.read(self._pipe, 256 * 1024)
        if not data:
            # Without a writer, reading a pipe returns end of file at once.
            time.sleep(min(0.02, max(0.0, left)))
        self._data += data
        if len(self._data) > LONGEST_PICTURE:
            self._data.clear()
            raise ProtocolFault(self._device, f"{self._path}: no picture ends in {LONGEST_PICTURE} bytes")
