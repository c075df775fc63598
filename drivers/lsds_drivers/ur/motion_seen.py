"""Motion of the arm as shown by its states: at rest or not, since when, and whether it slows down."""

from __future__ import annotations

import math

REST_M_S, REST_RAD_S = 5e-3, 2e-2
"""States below this, and below half of the fastest that was seen since the arm was set in motion, or commanded to stop,
show it at rest."""
LEAST_M_S, LEAST_RAD_S = 1e-3, 5e-3
"""But not below this, where a controller's own noise begins."""
_SLOWS = 0.99


class MotionSeen:
    """Times are arrivals (monotonic ns), 0 for never: `judged_ns` of the newest state; `rests_ns` and `runs_ns` since
    when all states show rest, or motion; `slowed_ns` when it was last seen to slow down since it was told to stop.

    One thread writes, another reads.
    """

    def __init__(self) -> None:
        self.judged_ns = self.rests_ns = self.runs_ns = self.slowed_ns = 0
        self._fastest, self._slowest = (0.0, 0.0), math.inf

    def set_in_motion(self) -> None:
        """Start a motion from rest: the fastest speed is measured from now on."""
        self._fastest = 0.0, 0.0

    def told_to_stop(self) -> None:
        """Start a stop: earlier states do not show whether the arm obeys it."""
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
