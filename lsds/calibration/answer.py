"""Delay of the fingers: the age of frames, and the time from a command until the gripper moves."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import median
from typing import TYPE_CHECKING

from lsds.clock import seconds
from lsds.contracts import Grip

if TYPE_CHECKING:
    from lsds.contracts import Cycle, Job, Setting, Situation, Wanted

MOVES_M = 1e-4
"""Minimum displacement of fingers that have begun to move, m; a coarser gripper's is its resolution."""
UNTIMED_S = 1.0
"""Time after which a gripper that has not moved is not timed, s: the command needed no motion."""


@dataclass(frozen=True, slots=True)
class Answer:
    """Medians over a run (s).

    `frame_s` is the age of a frame when it is evaluated. `gripper_s` is the gripper's time until it moves, NaN if it
    never moved from rest. `interval_s` is the frame interval of the slowest finger.
    """

    interval_s: float
    frame_s: float
    gripper_s: float

    @property
    def whole_s(self) -> float:
        """Maximum time from a change at the object to the fingers' motion, with one frame interval of waiting."""
        return self.interval_s + self.frame_s + self.gripper_s


class AnswerTimer:
    """A `Job` that wraps another one and times the gripper; pass it every cycle, too."""

    def __init__(self, job: Job) -> None:
        self._job = job
        self._wanted: Grip | None = None
        self._sent: tuple[int, float] | None = None
        self._tick_m = MOVES_M
        self._ages_s: list[float] = []
        self._gripper_s: list[float] = []

    def begin(self, setting: Setting) -> None:
        """Start a new run."""
        self._tick_m = MOVES_M if setting.gripper is None else max(MOVES_M, setting.gripper.resolution_m)
        self._job.begin(setting)

    def step(self, now: Situation) -> Wanted:
        """Return the job's commands, and record the time until the gripper moves."""
        wanted, state = self._job.step(now), now.gripper
        if self._sent is not None and state is not None:
            sent_ns, from_m = self._sent
            if abs(state.aperture_m - from_m) >= self._tick_m:
                self._gripper_s.append(seconds(state.t_ns - sent_ns))
                self._sent = None
            elif now.t_ns - sent_ns > UNTIMED_S * 1e9:
                self._sent = None
        if wanted.grip is not None and wanted.grip != self._wanted:
            # A command that is still unanswered is the one that the next motion answers.
            if self._sent is None and state is not None and not state.moving:
                self._sent = (now.t_ns, state.aperture_m)
            self._wanted = wanted.grip
        return wanted

    def take(self, cycle: Cycle) -> None:
        """Record the age of a cycle's frame."""
        self._ages_s.append(seconds(cycle.t_ns - cycle.frame.t_ns))

    def answer(self, interval_s: float) -> Answer:
        """Return the medians."""
        frame_s = median(self._ages_s) if self._ages_s else math.nan
        return Answer(interval_s, frame_s, median(self._gripper_s) if self._gripper_s else math.nan)
