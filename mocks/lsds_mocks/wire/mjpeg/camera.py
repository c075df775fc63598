"""A camera behind an MJPEG server: exposes on absolute deadlines, applies faults, encodes and publishes.

All wire cameras share this code; each supplies a `View` that renders its pictures.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import cv2
import numpy as np

from lsds.clock import NS_PER_S, nanoseconds
from lsds_mocks.wire.faults import MESSAGE_FAULTS, FaultInjector, FaultKind
from lsds_mocks.wire.journal import History, Journal
from lsds_mocks.wire.mjpeg.newest import Picture
from lsds_mocks.wire.mjpeg.pipe import JpegPipe
from lsds_mocks.wire.mjpeg.server import MjpegServer
from lsds_mocks.wire.serving_thread import ServingThread

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.clock import Clock
    from lsds.contracts.wire import ReceivedFrame
    from lsds_mocks.wire.mjpeg.options import CameraOptions

FACE = "http"
CAMERA_FAULTS: dict[FaultKind, tuple[str, ...]] = dict.fromkeys(
    (*MESSAGE_FAULTS, "disconnect", "freeze", "black-frame", "torn-frame"), (FACE,)
)
"""Supported faults. Picture faults also affect the pipe; message faults do not."""

_TORN_SHARE = 0.5
"""Share of its compressed image data that a torn JPEG keeps; chosen."""
_END_OF_IMAGE = b"\xff\xd9"
_WAIT_NS = 20_000_000
"""Longest sleep before the camera looks at its state again (ns); chosen."""
_PATIENCE_NS = 15_000_000
"""Maximum wait for an image that is not ready (ns); chosen."""
_FRAME_RETRY_NS = 1_000_000
"""Pause between two attempts to get it (ns); chosen."""


class View(Protocol):
    """The scene of a camera."""

    def picture(self, t_ns: int, seq: int, since_start: int) -> NDArray[np.uint8] | None:
        """Return a new uint8 RGB image of the instant `t_ns`; None if the scene at that instant is not available.

        `seq` counts exposures since the camera was switched on, `since_start` those since streaming began.
        """
        ...

    def truth(self, t_ns: int) -> Mapping[str, Any]:
        """Return the true state of the scene at the instant of the last exposure, with `moving`, in SI units."""
        ...

    def close(self) -> None:
        """Release its resources."""
        ...


class CameraMock:
    """A `WireMock` that renders only while a client is connected; time and frame numbers always advance."""

    def __init__(self, name: str, options: CameraOptions, view: View, *, seed: int, clock: Clock) -> None:
        self._options = options
        self._view = view
        self._clock = clock
        self._faults = FaultInjector(name, options.faults, CAMERA_FAULTS, seed=seed, clock=clock)
        self._journal = Journal(self._faults, clock)
        self._history = History()
        self._serving = ServingThread(name)
        self._instant_ns = clock.now()
        self._server = MjpegServer(name, options.host, options.port, self._faults, FACE, self._journal)
        self._pipe = JpegPipe(name, options.pipe) if options.pipe else None
        self._last: NDArray[np.uint8] | None = None
        self._since_start = 0

    def start(self) -> Mapping[str, str]:
        """Listen; return the addresses of stream, snapshot and pipe. Raises ConnectFailed."""
        host, port = self._server.start()
        shown = f"[{host}]" if ":" in host else host
        addresses = {
            FACE: f"http://{shown}:{port}/?action=stream",
            "snapshot": f"http://{shown}:{port}/?action=snapshot",
        }
        if self._pipe is not None:
            addresses["pipe"] = self._pipe.start()
        return addresses

    def serve(self, stop: threading.Event) -> None:
        """Expose until `stop` is set."""
        cv2.setNumThreads(1)
        start, seq = self._clock.now(), 0
        period_ns = NS_PER_S / self._options.rate_hz
        with self._serving.serving():
            while not stop.is_set():
                self._serving.turn()
                due = start + round(seq * period_ns)
                now = self._clock.now()
                if due > now:
                    # Wait in short intervals, so that even a slow camera stops at once.
                    self._clock.sleep_until(min(due, now + _WAIT_NS))
                    continue
                missed = int((now - due) // period_ns)
                seq += missed  # late exposures are skipped; the phase stays
                self._instant_ns = start + round(seq * period_ns)
                self._expose(self._instant_ns, seq)
                seq += 1

    def inject(self, fault: Mapping[str, Any]) -> None:
        """Begin a fault now. Raises ConfigError for one that cameras do not have."""
        self._faults.add(fault)
        self._serving.run(self._server.strike)

    def end_fault(self, name: str) -> None:
        """End the faults of a name; the camera accepts clients again."""
        self._faults.end(name)
        self._server.reconnect()

    def received(self, since: int) -> Sequence[ReceivedFrame]:
        """Return the HTTP requests with a number of at least `since`."""
        return self._journal.received(since)

    def truths(self, since_ns: int) -> Sequence[Mapping[str, Any]]:
        """Return the states of the scene since a time, one for each request of this function."""
        return self._serving.run(
            lambda: self._history.since(since_ns, self._instant_ns, self._view.truth(self._instant_ns))
        )

    def close(self) -> None:
        """Release port, pipe and view."""
        self._server.close()
        if self._pipe is not None:
            self._pipe.close()
        self._view.close()

    # -- inside -------------------------------------------------------------------------------------------

    def _expose(self, t_ns: int, seq: int) -> None:
        piped = self._pipe is not None and self._pipe.watched
        if not self._server.watched and not piped:
            self._since_start = 0
            self._server.strike()  # a disconnect also applies to an idle camera
            return
        image = self._image(t_ns, seq)
        if image is None:
            return
        jpeg = encode(image, self._options.quality)
        if self._faults.strikes("torn-frame", FACE):
            jpeg = torn(jpeg)
        if self._options.latency_ms > 0:
            self._clock.sleep_until(t_ns + nanoseconds(self._options.latency_ms * 1e-3))
        picture = Picture(jpeg, t_ns, seq)
        self._server.publish(picture)
        if self._pipe is not None and piped:
            self._pipe.publish(picture)

    def _image(self, t_ns: int, seq: int) -> NDArray[np.uint8] | None:
        if self._faults.strikes("freeze", FACE) and self._last is not None:
            return self._last
        image = self._view.picture(t_ns, seq, self._since_start)
        # Events of this instant may not have arrived from another process yet.
        while image is None and (now := self._clock.now()) - t_ns < _PATIENCE_NS:
            self._clock.sleep_until(now + _FRAME_RETRY_NS)
            image = self._view.picture(t_ns, seq, self._since_start)
        if image is None:
            return None
        streaming = self._server.streaming or (self._pipe is not None and self._pipe.watched)
        self._since_start = self._since_start + 1 if streaming else 0
        if self._faults.strikes("black-frame", FACE):
            return np.zeros_like(image)
        self._last = image
        return image


def encode(image: NDArray[np.uint8], quality: int) -> bytes:
    """Return an RGB image as JPEG with full-resolution luminance and half-resolution chrominance, as UVC cameras do."""
    _, jpeg = cv2.imencode(".jpg", cv2.cvtColor(image, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, quality])
    return jpeg.tobytes()


def torn(jpeg: bytes) -> bytes:
    """Return a JPEG without its lower part but with an end marker, which passes a check of both ends."""
    start_of_scan = jpeg.index(b"\xff\xda")
    cut = start_of_scan + round((len(jpeg) - start_of_scan) * _TORN_SHARE)
    # Do not split an escaped byte pair, or the end marker would read as image data.
    while jpeg[cut - 1] == 0xFF:
        cut -= 1
    return jpeg[:cut] + _END_OF_IMAGE
