"""Take up the load: lift slowly until the object hangs in the grip, so that a grip which is too loose slips slowly."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

from lsds.clock import nanoseconds
from lsds.tactile.carried_load import LEAST_N

if TYPE_CHECKING:
    from lsds.contracts import Situation

LEAST_S, MOST_S = 0.4, 3.0
"""Least duration, and the greatest while nothing slips."""
STEADY_S, STEADY, NOISE_N = 0.28, 0.06, 0.02
"""The load is taken up when for this time it has changed by less than this share and the noise, and nothing slipped."""
PROBABLY, MAYBE = 0.5, 0.25
"""Probabilities of a slide: at the first the object is not lifted faster for `STEADY_S`; at the second its load is not
yet taken for that of a hanging object."""


class TakeUp:
    """Tells when the load has been taken up.

    `has_load` is whether the object hung when it was over, and not only the time was up.
    """

    def __init__(self, start_ns: int) -> None:
        self._start_ns = start_ns
        self.has_load = False
        self._loads: deque[tuple[int, float]] = deque()
        self._seen_ns = self._slipped_ns = -1

    def step(self, now: Situation) -> bool:
        """Return whether it is over."""
        self._see(now)
        elapsed = now.t_ns - self._start_ns
        if elapsed < nanoseconds(LEAST_S) or now.t_ns - self._slipped_ns < nanoseconds(STEADY_S):
            # An object that slips during a slow lift would slip faster in a fast one.
            return False
        forces = [force for _, force in self._loads]
        spans = self._loads and self._loads[-1][0] - self._loads[0][0] > nanoseconds(STEADY_S - 0.1)
        # Before the arm has moved, nothing changes either.
        pulls = bool(forces) and forces[-1] > LEAST_N
        self.has_load = pulls and bool(spans) and max(forces) - min(forces) < STEADY * max(forces) + NOISE_N
        return self.has_load or elapsed > nanoseconds(MOST_S)

    def _see(self, now: Situation) -> None:
        if now.cycle is None or now.cycle.t_ns == self._seen_ns:
            return
        self._seen_ns, grip = now.cycle.t_ns, now.cycle.grip
        if grip.slips > PROBABLY:
            self._slipped_ns = now.t_ns
        if not math.isfinite(grip.load_n) or grip.slips > MAYBE:
            self._loads.clear()
            return
        self._loads.append((now.cycle.t_ns, grip.load_n))
        while self._loads[-1][0] - self._loads[0][0] > nanoseconds(STEADY_S):
            self._loads.popleft()
