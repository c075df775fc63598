"""Faults of a camera's frame stream: late, lost, repeated, swapped or undecodable frames, and wrong time stamps."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import Any

from lsds.clock import nanoseconds
from lsds.contracts import Frame
from lsds.errors import DataError, DeviceTimeout, StaleData
from lsds_mocks.faults.made import fault
from lsds_mocks.faults.plan import Around, Plan

NAME = "camera"
FRAMES_KEPT = 64
"""Maximum number of delayed frames that wait; beyond it, the oldest are lost; chosen."""


class Stream(Around):
    """A sensor with a fault of its stream.

    While the fault is on, `take` receives each new frame and returns the frame to deliver, or None to deliver none. The
    sequence number goes on counting.
    """

    def __init__(self, part: Any, plan: Plan) -> None:
        super().__init__(part, plan)
        self._newest: Frame | None = None
        self.seen: Frame | None = None

    def read(self) -> Frame:
        """Return the newest frame that the fault lets through. Raises StaleData before the first frame."""
        frame: Frame = self._part.read()
        if frame is not self._newest:
            self._newest = frame
            found = self.take(frame) if self._plan.on else frame
            self.seen = self.seen if found is None else found
        if self.seen is None:
            raise StaleData(NAME, "no frame has arrived yet")
        return self.seen

    def take(self, frame: Frame) -> Frame | None:
        """Return the frame to deliver for a new frame, or None to deliver none."""
        return frame


class _Frozen(Stream):
    def take(self, frame: Frame) -> Frame | None:
        return None


class _Repeats(Stream):
    def take(self, frame: Frame) -> Frame | None:
        return frame if self.seen is None else replace(frame, image=self.seen.image)


class _Duplicates(Stream):
    def take(self, frame: Frame) -> Frame | None:
        twice = self.seen is not None and self._plan.happens()
        return replace(frame, image=self.seen.image) if twice and self.seen is not None else frame


class _Drops(Stream):
    def take(self, frame: Frame) -> Frame | None:
        return None if self._plan.happens() else frame


class _Jitter(Stream):
    def take(self, frame: Frame) -> Frame | None:
        return replace(frame, t_ns=frame.t_ns + nanoseconds(float(self._plan.rng.normal(0, self._plan.level))))


class _ClockStep(Stream):
    sign = 1

    def take(self, frame: Frame) -> Frame | None:
        return replace(frame, t_ns=frame.t_ns + self.sign * nanoseconds(self._plan.level))


class _ClockBack(_ClockStep):
    sign = -1


class _Swaps(Stream):
    """Holds a frame back and delivers it right after its successor; both keep their time stamps."""

    def __init__(self, part: Any, plan: Plan) -> None:
        super().__init__(part, plan)
        self._kept: Frame | None = None
        self._next: Frame | None = None

    def read(self) -> Frame:
        """Return the newest frame, or the one that should have come before it."""
        after, self._next = self._next, None
        if after is None:
            return super().read()
        self.seen = after
        return after

    def take(self, frame: Frame) -> Frame | None:
        kept, self._kept = self._kept, None
        if kept is not None:
            self._next = replace(kept, seq=frame.seq)
            return replace(frame, seq=kept.seq)
        if self._plan.happens():
            self._kept = frame
            return None
        return frame


class _Late(Stream):
    """Delays frames. Frames from before the fault were delivered without delay."""

    unsaid = False

    def __init__(self, part: Any, plan: Plan) -> None:
        super().__init__(part, plan)
        self._waiting: deque[tuple[int, Frame]] = deque(maxlen=FRAMES_KEPT)

    def take(self, frame: Frame) -> Frame | None:
        self._waiting.append((self._plan.clock.now() + nanoseconds(self._plan.level), frame))
        return None

    def read(self) -> Frame:
        """Return the newest frame whose delay is over. Raises StaleData before the first frame."""
        super().read()
        while self._waiting and self._waiting[0][0] <= self._plan.clock.now():
            _, frame = self._waiting.popleft()
            late_ns = nanoseconds(self._plan.level) if self.unsaid else 0
            self.seen = replace(frame, t_ns=frame.t_ns + late_ns)
        if self.seen is None:
            raise StaleData(NAME, "no frame has arrived yet")
        return self.seen


class _LateUnsaid(_Late):
    unsaid = True


class _Garbled(Around):
    """Decides once per frame whether it is damaged, so that reading one frame twice gives the same result."""

    def __init__(self, part: Any, plan: Plan) -> None:
        super().__init__(part, plan)
        self._newest: Frame | None = None
        self._bad = False

    def read(self) -> Frame:
        """Return the newest frame. Raises DataError if it is damaged."""
        frame: Frame = self._part.read()
        if frame is not self._newest:
            self._newest, self._bad = frame, self._plan.happens()
        if self._bad:
            raise DataError(f"frame {frame.seq} cannot be decoded")
        return frame


class _Gone(Around):
    def read(self) -> Frame:
        """Return the newest frame. Raises DeviceTimeout once the camera is gone."""
        if self._plan.on:
            raise DeviceTimeout(NAME, "it does not answer any more", remedy="check its cable")
        frame: Frame = self._part.read()
        return frame


frozen = fault(_Frozen, "stream:frozen")
repeats = fault(_Repeats, "stream:repeats")
late = fault(_Late, "stream:late")
late_unsaid = fault(_LateUnsaid, "stream:late_unsaid")
drops = fault(_Drops, "stream:drops")
duplicates = fault(_Duplicates, "stream:duplicates")
swaps = fault(_Swaps, "stream:swaps")
jitter = fault(_Jitter, "stream:jitter")
clock_step = fault(_ClockStep, "stream:clock_step")
clock_back = fault(_ClockBack, "stream:clock_back")
garbled = fault(_Garbled, "stream:garbled")
gone = fault(_Gone, "stream:gone")
