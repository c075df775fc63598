"""The part that all sensors share that play something stored as if it were a camera."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Generator
from typing import TYPE_CHECKING

from lsds.clock import nanoseconds
from lsds.contracts.lifecycle import LifecycleGuard, MotionlessLife
from lsds.errors import ConnectFailed, DataError, StaleData

if TYPE_CHECKING:
    from lsds.clock import Clock
    from lsds.contracts import Frame, SensorSpec


class PlayedSensor(MotionlessLife, ABC):
    """A `TactileSensor` that shows each frame from its time stamp on, and ends with EOFError."""

    def __init__(self, name: str, path: str, clock: Clock) -> None:
        self._name, self._path, self._clock = name, path, clock
        self._guard = LifecycleGuard(name)

    @property
    @abstractmethod
    def spec(self) -> SensorSpec:
        """Size of the frames, nominal rate and scale."""

    @abstractmethod
    def frames(self, start_ns: int = 0) -> Generator[Frame, None, None]:
        """Yield every frame, for work that does not wait for a clock. Raises DataError naming file and frame."""

    def connect(self) -> None:
        """Open the recording; its first frame's time is now. Raises ConnectFailed."""
        with self._guard.connecting():
            try:
                _ = self.spec
                self._frames = self.frames(self._clock.now())
                self._next: Frame | None = next(self._frames, None)
                if self._next is None:
                    raise DataError(f"{self._path}: the recording has no frame")
            except DataError as error:
                raise ConnectFailed(self._name, str(error)) from error
            self._now: Frame | None = None
            self._failure: DataError | None = None

    def close(self) -> None:
        """Let go of the file."""
        with self._guard.closing() as first:
            if first and hasattr(self, "_frames"):
                self._frames.close()

    def read(self) -> Frame:
        """Return the newest frame due. Raises StaleData before the first, DataError for a damaged one, EOFError after
        the last."""
        self._guard.require_readable()
        now = self._clock.now()
        while self._next is not None and self._next.t_ns <= now:
            self._now = self._next
            try:
                self._next = next(self._frames, None)
            except DataError as error:
                self._next, self._failure = None, error
            if self._next is None:
                # The last frame is shown for its own interval before the recording counts as over.
                self._end_ns = now + nanoseconds(1 / self.spec.rate_hz)
        if self._now is None:
            raise StaleData("video", "the first frame is not due yet")
        if self._next is None and now >= self._end_ns:
            if self._failure is not None:
                raise self._failure
            raise EOFError(f"{self._path}: the recording has ended after frame {self._now.seq}")
        return self._now
