"""The thread of a camera: reads all pictures, keeps the newest, and reopens the camera when it is lost."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, NamedTuple, Protocol, TypeVar

from lsds.clock import NS_PER_S, nanoseconds, seconds
from lsds.errors import ConnectFailed, DataError, DeviceError, LsdsError, ProtocolFault, StaleData
from lsds_drivers.cameras.times import ExposureTimes, FrameNumbers

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lsds.clock import Clock
    from lsds_drivers.cameras.source import FrameSource, Shot

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)

_RETRY_S = 0.1
"""First pause before a lost camera is opened again, s; chosen."""
_LONGEST_RETRY_S = 2.0
"""Longest such pause, s; each failure doubles the pause up to this; chosen."""
_RATE_SHARE = 0.1
"""Weight of the newest interval in the mean interval between pictures; chosen."""
_PUMP_GRACE_S = 0.2
"""Time beyond a source's limit for which the first picture is awaited, s; chosen."""
_STALE_FRAMES = 5
"""Number of mean intervals after which the newest picture is stale; chosen."""
CLOSE_TIMEOUT_S = 2.0
"""Time limit for the end of the camera's thread, s; chosen."""


class Work(Protocol[T_co]):
    """The processing of each picture, in the camera's thread."""

    def __call__(self, image: NDArray[np.uint8], t_ns: int, seq: int) -> T_co:
        """Return the result for `read`. Raises DataError for a picture that cannot be used."""
        ...


class Sample(NamedTuple, Generic[T]):
    """The newest result, and when its picture was exposed."""

    value: T
    t_ns: int


@dataclass(frozen=True, slots=True)
class PumpLimits:
    """Time limits: for the first picture, for the next one, and for the age of the newest (None: five measured
    intervals, at least half a second). `skip` pictures are discarded after each opening, because a camera's first
    pictures are dark."""

    connect_timeout_s: float = 5.0
    silence_s: float = 1.0
    stale_after_s: float | None = None
    skip: int = 0


class FramePump(Generic[T]):
    """Runs one source. `start` once, `newest` from any thread, `close` once."""

    def __init__(
        self,
        device: str,
        source: FrameSource,
        work: Work[T],
        clock: Clock,
        *,
        limits: PumpLimits | None = None,
        times: ExposureTimes | None = None,
        remedy: str = "check the camera and its cable",
    ) -> None:
        self._device = device
        self._source = source
        self._work = work
        self._clock = clock
        self._limits = limits or PumpLimits()
        self._times = times or ExposureTimes("auto")
        self._numbers = FrameNumbers()
        self._remedy = remedy
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._interval_s: float | None = None
        self._begin()
        self.lost = 0
        """Number of times that the camera was lost and reopened, including attempts."""

    def _begin(self) -> None:
        """Clear the state of a failed start."""
        self._stop, self._first = threading.Event(), threading.Event()
        self._sample: Sample[T] | None = None
        self._damaged: DataError | None = None
        self._refused: LsdsError | EOFError | None = None
        self._trouble = ""
        self._unusable = ""
        self._retry_s = _RETRY_S
        self._due_ns = 0

    @property
    def measured_rate_hz(self) -> float | None:
        """Measured frame rate from the frame times; None before the second frame."""
        interval = self._interval_s
        return None if not interval else 1.0 / interval

    @property
    def times_from_device(self) -> bool:
        """True if exposure times are the device's stamps, false if they are arrival times."""
        return self._times.from_device

    def start(self) -> None:
        """Open the camera and wait for its first good picture; after a failure it can be tried again.

        Raises ConnectFailed, within the limit.
        """
        if self._thread is not None and self._thread.is_alive():
            raise ConnectFailed(
                self._device, "the last attempt to open it still hangs", remedy="unplug the camera and plug it in again"
            )
        self._begin()
        self._thread = threading.Thread(target=self._run, name=f"{self._device}-camera", daemon=True)
        limit_s = self._limits.connect_timeout_s
        self._due_ns = self._clock.now() + nanoseconds(limit_s)
        self._thread.start()
        # Wait a little longer than the source itself, so that its own error message is reported.
        self._first.wait(limit_s + _PUMP_GRACE_S)
        refused, trouble, came = self._refused, self._unusable or self._trouble, self._first.is_set()
        if came and refused is None:
            return
        self.close()
        if isinstance(refused, DeviceError) and not self._unusable:
            raise ConnectFailed(self._device, refused.problem, remedy=refused.remedy or self._remedy) from refused
        problem = str(trouble or refused or f"no picture came in {limit_s:.1f} s")
        raise ConnectFailed(self._device, problem, remedy=self._remedy) from refused

    def newest(self) -> T:
        """Return the newest result.

        Raises DataError once for a damaged picture, StaleData before the first picture or if the newest is too old, and
        EOFError after the last picture of a recording.
        """
        with self._lock:
            damaged, self._damaged = self._damaged, None
            sample, refused = self._sample, self._refused
        if damaged is not None:
            raise damaged
        if isinstance(refused, EOFError):
            raise EOFError(str(refused))
        if sample is None:
            raise StaleData(self._device, "no frame has arrived yet", remedy=self._trouble or "read again")
        age_s = seconds(self._clock.now() - sample.t_ns)
        if age_s > self.stale_after_s:
            raise StaleData(
                self._device, f"the newest frame is {age_s:.2f} s old", remedy=self._trouble or self._remedy
            )
        return sample.value

    @property
    def stale_after_s(self) -> float:
        """Maximum age of the newest frame (s)."""
        if self._limits.stale_after_s is not None:
            return self._limits.stale_after_s
        return max(0.5, _STALE_FRAMES * (self._interval_s or 0.0))

    def close(self) -> None:
        """End the thread and release the camera. Returns within `CLOSE_TIMEOUT_S` even if the camera hangs; the thread
        then ends when the camera responds."""
        self._stop.set()
        if self._thread is not None and self._thread.is_alive():
            self._source.interrupt()
            self._thread.join(CLOSE_TIMEOUT_S)

    # -- the thread ---------------------------------------------------------------------------------------

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                self._source.open(self._limits.connect_timeout_s)
                self._stream()
            except EOFError as error:
                self._refuse(error)
            except LsdsError as error:
                self._note(error)
            except Exception as error:  # a vendor's library may raise anything; treat it as a lost camera
                self._note(ProtocolFault(self._device, f"{type(error).__name__}: {error}"))
            finally:
                self._source.close()
            if self._stop.is_set() or self._refused is not None:
                return
            self.lost += 1
            self._stop.wait(self._retry_s)
            self._retry_s = min(2 * self._retry_s, _LONGEST_RETRY_S)

    def _stream(self) -> None:
        """Take pictures until asked to stop."""
        self._numbers.restart()
        skip = self._limits.skip
        while not self._stop.is_set():
            try:
                shot = self._source.shot(self._patience_s())
            except DataError as error:
                self._damage(error, self._numbers.of(None))
                continue
            seq = self._numbers.of(shot.number)
            if skip > 0:
                skip -= 1
                continue
            self._take(shot, seq)

    def _patience_s(self) -> float:
        """Time limit for the next picture; for the first good one, the remaining time to connect."""
        if self._first.is_set():
            return self._limits.silence_s
        return max(0.05, seconds(self._due_ns - self._clock.now()))

    def _take(self, shot: Shot, seq: int) -> None:
        t_ns = self._times.of(shot.arrived_ns, shot.stamp_ns)
        try:
            value = self._work(shot.image, t_ns, seq)
        except DataError as error:
            self._damage(error, seq)
            return
        with self._lock:
            if self._sample is not None:
                self._measure((t_ns - self._sample.t_ns) / NS_PER_S)
            self._sample, self._trouble = Sample(value, t_ns), ""
        self._retry_s = _RETRY_S
        self._first.set()

    def _measure(self, interval_s: float) -> None:
        if self._interval_s is None or interval_s > 20 * self._interval_s:
            self._interval_s = interval_s
        else:
            self._interval_s += _RATE_SHARE * (interval_s - self._interval_s)

    def _damage(self, error: DataError, seq: int) -> None:
        with self._lock:
            self._damaged = DataError(f"{self._device}: frame {seq}: {error}")
            self._unusable = str(error)

    def _note(self, error: LsdsError) -> None:
        self._trouble = error.problem if isinstance(error, DeviceError) else str(error)
        if not self._first.is_set():
            self._refuse(error)

    def _refuse(self, error: LsdsError | EOFError) -> None:
        self._refused = error
        self._first.set()


def stale_limit(stale_after_ms: float) -> float | None:
    """Return an option in ms as the limit in s; 0 means that the measured rate decides."""
    return seconds(nanoseconds(stale_after_ms * 1e-3)) if stale_after_ms > 0 else None
