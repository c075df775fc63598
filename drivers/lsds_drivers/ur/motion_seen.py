"""Detection of the arm's motion from its states: at rest or moving, since when, and whether it decelerates."""

from __future__ import annotations

import math

REST_M_S = 5e-3
"""Speed below which a state shows rest, m/s, if it is also below half of the fastest speed since the last start of a
motion or of a stop; chosen."""
REST_RAD_S = 2e-2
"""Angular velocity below which a state shows rest, rad/s, under the same condition; chosen."""
LEAST_M_S = 1e-3
"""Speed below which a state always shows rest, m/s: the noise of the controller."""
LEAST_RAD_S = 5e-3
"""Angular velocity below which a state always shows rest, rad/s: the noise of the controller."""
_SLOWS = 0.99
"""Pace relative to the slowest since the command to stop below which a state shows deceleration; chosen."""


class MotionSeen:
    """Arrival times of states (monotonic ns); 0 for never. One thread writes, another reads.

    `judged_ns`: the newest state. `rests_ns`, `runs_ns`: the first of the latest states that all show rest, or motion.
    `slowed_ns`: the last state that shows deceleration since the command to stop.
    """

    def __init__(self) -> None:
        self.judged_ns = self.rests_ns = self.runs_ns = self.slowed_ns = 0
        self._fastest, self._slowest = (0.0, 0.0), math.inf

    def set_in_motion(self) -> None:
        """Start a motion from rest: the fastest speed is measured from now on."""
        self._fastest = 0.0, 0.0

    def begin_stop(self) -> None:
        """Record the command to stop; earlier states do not show whether the arm obeys it."""
        self._fastest = 0.0, 0.0
        self.rests_ns, self._slowest, self.slowed_ns = 0, math.inf, 0

    def judge(self, speed: tuple[float, ...], now: int) -> None:
        """Add a state's speed (m/s and rad/s, six numbers). NaN counts as not at rest."""
        slides, turns = math.hypot(*speed[:3]), math.hypot(*speed[3:])
        fast, turning = self._fastest = max(self._fastest[0], slides), max(self._fastest[1], turns)
        slides_little = slides < max(LEAST_M_S, min(REST_M_S, fast / 2))
        if slides_little and turns < max(LEAST_RAD_S, min(REST_RAD_S, turning / 2)):
            self.rests_ns, self.runs_ns = self.rests_ns or now, 0
        else:
            self.rests_ns, self.runs_ns = 0, self.runs_ns or now
        pace = max(slides / REST_M_S, turns / REST_RAD_S)
        if pace < _SLOWS * self._slowest:
            self._slowest, self.slowed_ns = pace, now
        self.judged_ns = now
