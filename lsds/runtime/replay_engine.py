"""The engine on a recording: the same line from image to command, fed with the events of a run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from lsds.clock import perf_ns
from lsds.contracts.events import ArmRead, Corrected, FramesRead, GripperRead, JobStepped, PosesRead
from lsds.errors import DataError
from lsds.runtime.actuation import Actuation
from lsds.runtime.engine import Engine
from lsds.runtime.finger_pipeline import FingerLine

if TYPE_CHECKING:
    from lsds.contracts import Grip, GripEstimate, GripperState, Twist
    from lsds.contracts.events import Event
    from lsds.runtime.rig import Rig


class RecordedActuation(Actuation):
    """Sends nothing: the gripper did what it did.

    `reply` is the recorded correction of the present frame, `asked_m` the aperture that the replayed controller wants.
    """

    reply: Corrected | None = None
    asked_m: float = math.nan

    def grip(self, wanted: Grip | None, state: GripperState | None, now_ns: int) -> bool:
        """Send nothing: the recording says what was sent."""
        return False

    def watch(self, state: GripperState | None, now_ns: int) -> None:
        """Check nothing: the recorded run did."""

    def correct(self, aperture_m: float, *, may_open: bool) -> float | None:
        """Return what the recorded run sent, so that commands and fingers stay those of the recording."""
        self.asked_m = aperture_m
        sent_m = None if self.reply is None else self.reply.sent_m
        if sent_m is not None:
            self.held_m = sent_m
        return sent_m

    def move(self, twist: Twist, acceleration_m_s2: float) -> None:
        """Move nothing."""


class ReplayEngine(Engine):
    """Runs a rig of recorded devices through the events of a run, in their order and at their times.

    The algorithms are those of the rig; the job's wishes, and what gripper and arm did, are those of the recording: it
    is an open loop. `wanted_m` is the aperture that the controller wanted in the last cycle, NaN for none.
    """

    def __init__(self, rig: Rig, events: Iterable[Event], *, live: bool) -> None:
        """`live`: the recorded frames came from a running cell, which a gate judges by their age."""
        super().__init__(rig)
        start_ns = rig.clock.now()
        self._recorded = False
        self.lines = tuple(FingerLine(finger, rig, start_ns, live=live) for finger in rig.fingers)
        self._replies = RecordedActuation(rig.gripper, rig.arm, rig.config, rig.clock)
        self._act = self._replies
        self._by_name = {line.finger.name: line for line in self.lines}
        self._inputs = _with_replies(events)

    @property
    def wanted_m(self) -> float:
        """The aperture that the controller wanted in the last cycle, m; NaN if it wanted none."""
        return self._replies.asked_m

    def _advance(self) -> bool:
        if self._ended:
            return False
        found = next(self._inputs, None)
        if found is None:
            self._ended = True
            return False
        event, reply = found
        self._clock.sleep_until(event.now_ns)
        self._replies.reply, self._replies.asked_m = reply, math.nan
        self._take(event)
        return not self._ended

    def _correct(self, grip: GripEstimate, now_ns: int) -> float | None:
        command = super()._correct(grip, now_ns)
        if self._replies.reply is not None and self._replies.reply.sent_m is not None:
            # The fingers moved, whether or not this controller wants it.
            self._replies.held_m = self._replies.reply.sent_m
        return command

    def _take(self, event: Event) -> None:
        now_ns, states = event.now_ns, self._states
        match event:
            case FramesRead(_, frames, depends):
                self._see([(self._line(name), frame) for name, frame in frames], now_ns, perf_ns(), depends=depends)
            case GripperRead(_, state):
                states.take_gripper(state)
            case ArmRead(_, arm):
                states.arm = arm
            case PosesRead(_, sample, problem):
                states.pose, states.pose_problem = sample, problem
            case JobStepped(_, wanted, sent, held_m):
                before = self._wanted
                self._adopt(wanted, now_ns)
                self._replies.held_m = held_m
                if sent or (wanted.corrects and not before.corrects):
                    self._begin_grip()
                if wanted.done:
                    self.stop()

    def _line(self, name: str) -> FingerLine:
        if name not in self._by_name:
            raise DataError(f"the recording has a frame of finger '{name}', the rig has {', '.join(self._by_name)}")
        return self._by_name[name]


def _with_replies(events: Iterable[Event]) -> Iterator[tuple[Event, Corrected | None]]:
    """Yield each event with the correction that was sent for it, which is recorded after it."""
    waiting: Event | None = None
    for event in events:
        if isinstance(event, Corrected):
            if waiting is not None:
                yield waiting, event
            waiting = None
            continue
        if waiting is not None:
            yield waiting, None
        waiting = event
    if waiting is not None:
        yield waiting, None
