"""The thread of the camera: keeps the newest frame, and opens the camera again when it is lost."""

from __future__ import annotations

import threading

from lsds.contracts import Frame
from lsds.errors import DeviceError, ProtocolFault

from lsds_digit.camera import Camera

RETRY_S = 0.5
"""Time between attempts to open a lost camera (s)."""
JOIN_S = 2.0
"""Time that `stop` waits for the thread (s). OpenCV blocks for up to 10 s if a camera hangs."""


class Grabber:
    """Reads a camera in a separate thread. `newest` and `trouble` are safe to read from any thread."""

    def __init__(self, name: str, camera: Camera) -> None:
        self._name = name
        self._camera = camera
        self._ended = threading.Event()
        self._first = threading.Event()
        self._thread: threading.Thread | None = None
        self._seq = 0
        self.newest: Frame | None = None
        self.trouble: DeviceError | None = None

    def start(self, timeout_s: float) -> None:
        """Read the open camera, and wait for the first frame or the first failure."""
        self._ended.clear()
        self._first.clear()
        self.newest = self.trouble = None
        self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
        self._thread.start()
        self._first.wait(timeout_s)

    def stop(self) -> None:
        """End the thread, which closes the camera. A second call does nothing."""
        self._ended.set()
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.join(JOIN_S)

    def _run(self) -> None:
        while not self._ended.is_set():
            try:
                if self.trouble is not None:
                    self._camera.open()
                self._stream()
            except DeviceError as error:
                self.trouble = error
            except Exception as error:  # OpenCV raises its own errors when a device is unplugged
                self.trouble = ProtocolFault(self._name, f"OpenCV failed: {error}", remedy="check the cable")
            finally:
                self._camera.close()
            self._first.set()
            self._ended.wait(RETRY_S)

    def _stream(self) -> None:
        while not self._ended.is_set():
            shot = self._camera.shot()
            last = self.newest
            # Two frames never share a time, also if both arrive at once.
            t_ns = shot.t_ns if last is None else max(shot.t_ns, last.t_ns + 1)
            self.newest = Frame(shot.image, t_ns, self._seq)
            self._seq += 1
            self.trouble = None
            self._first.set()
