"""A thread that reads a fingertip and keeps its newest image."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

from lsds.errors import DataError, StaleData

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lerobot_camera_lsds.fingertip import Fingertip

POLLS_PER_FRAME = 4
"""A real sensor is read this often per frame interval, so that an image waits at most a quarter of it."""
JOIN_S = 2.0
"""Time limit for the end of the thread when the camera is disconnected (s)."""


class Capture:
    """Reads in its own thread from `start` to `stop`.

    A missing or damaged frame is waited out, because the next one may be good. Any other error ends the thread, and
    every later call raises it.
    """

    def __init__(self, tip: Fingertip) -> None:
        self._tip = tip
        self._changed = threading.Condition()
        self._ended = False
        self._image: NDArray[np.uint8] | None = None
        self._taken_s = 0.0
        self._count = self._consumed = 0
        self._error: BaseException | None = None
        self._reason = ""
        self._thread = threading.Thread(target=self._run, name="lsds-camera", daemon=True)

    def start(self) -> None:
        """Start reading."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._ended = True
        self._thread.join(JOIN_S)

    def next(self, timeout_s: float, *, after_now: bool = False) -> NDArray[np.uint8]:
        """Return the newest image (h, w, 3) that was not returned yet; wait for it.

        `after_now` waits for one that arrives after this call. Raises TimeoutError, or the error that ended the thread.
        """
        with self._changed:
            seen = self._count if after_now else self._consumed
            self._changed.wait_for(lambda: self._count > seen or self._error is not None, timeout_s)
            self._check()
            if self._image is None or self._count <= seen:
                why = f" ({self._reason})" if self._reason else " (check the cable and whether the sensor streams)"
                raise TimeoutError(f"camera lsds: no new frame within {1e3 * timeout_s:g} ms{why}")
            self._consumed = self._count
            return self._image

    def latest(self, max_age_s: float) -> NDArray[np.uint8]:
        """Return the newest image at once. Raises RuntimeError before the first, TimeoutError if it is too old."""
        with self._changed:
            self._check()
            if self._image is None:
                raise RuntimeError("camera lsds: no frame has arrived yet; call read() first")
            age_s = time.perf_counter() - self._taken_s
            if age_s > max_age_s:
                raise TimeoutError(
                    f"camera lsds: the newest frame is {1e3 * age_s:.0f} ms old, the limit is {1e3 * max_age_s:g} ms "
                    "(check whether the sensor streams)"
                )
            return self._image

    def _check(self) -> None:
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        polls = 1 if self._tip.simulated else POLLS_PER_FRAME
        pause_s = 1 / (self._tip.spec.rate_hz * polls)
        last: int | None = None
        while not self._ended:
            began_s = time.perf_counter()
            try:
                self._tip.step()
                frame = self._tip.read()
            except (StaleData, DataError) as error:
                self._reason = str(error)
            except BaseException as error:
                with self._changed:
                    self._error = error
                    self._changed.notify_all()
                return
            else:
                if frame.seq != last:
                    last = frame.seq
                    with self._changed:
                        self._image, self._taken_s, self._reason = frame.image, began_s, ""
                        self._count += 1
                        self._changed.notify_all()
            time.sleep(max(0.0, pause_s - (time.perf_counter() - began_s)))
