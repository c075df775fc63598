"""How soon the fingers answer: the age of frames, and the time from a command until the gripper moves."""

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
"""Fingers that were at rest have begun to move when they are so far from where they were, or a tick."""
LATE_S = 1.0
"""A gripper that has not moved after so long did not have to."""


@dataclass(frozen=True, slots=True)
class Answer:
    """Medians over a run (s): age of a frame when it is evaluated, and the gripper's time until it moves; NaN where
    the gripper never moved on its own. `interval_s` is that of the slowest finger's frames."""

    interval_s: float
    frame_s: float
    gripper_s: float

    @property
    def whole_s(self) -> float:
        """Time from a change at the object to the fingers' answer: until it is in a frame at the latest, and so on."""
        return self.interval_s + self.frame_s + self.gripper_s


class AnswerTimer:
    """A `Job` around another one, which times the gripper; give it every cycle, too."""

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
        """Return what the job wants, and note when the gripper moves for it."""
        wanted, state = self._job.step(now), now.gripper
        if self._sent is not None and state is not None:
            sent_ns, from_m = self._sent
            if abs(state.aperture_m - from_m) >= self._tick_m:
                self._gripper_s.append(seconds(state.t_ns - sent_ns))
                self._sent = None
            elif now.t_ns - sent_ns > LATE_S * 1e9:
                self._sent = None
        if wanted.grip is not None and wanted.grip != self._wanted:
            rests = state is not None and not state.moving
            self._sent = (now.t_ns, state.aperture_m) if state is not None and rests else None
            self._wanted = wanted.grip
        return wanted

    def take(self, cycle: Cycle) -> None:
        """Note the age of a cycle's frame."""
        self._ages_s.append(seconds(cycle.t_ns - cycle.frame.t_ns))

    def answer(self, interval_s: float) -> Answer:
        """Return what was found."""
        frame_s = median(self._ages_s) if self._ages_s else math.nan
        return Answer(interval_s, frame_s, median(self._gripper_s) if self._gripper_s else math.nan)
