"""Take up the load: lift slowly until the object hangs in the grip, so that a grip which is too loose slips slowly."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

from lsds.clock import nanoseconds
from lsds.tactile.carried_load import LEAST_EVIDENCE_N

if TYPE_CHECKING:
    from lsds.contracts import Situation

LEAST_TAKE_UP_S = 0.4
"""Minimum duration, s; chosen."""
MOST_TAKE_UP_S = 3.0
"""Maximum duration while the object does not slip, s; chosen."""
LOAD_STEADY_S = 0.28
"""Time for which the load must be steady, without slip, before it counts as taken up, s; chosen."""
LOAD_STEADY_SHARE = 0.06
"""Maximum range of a steady load in that time, as a share of the load; chosen."""
LOAD_NOISE_N = 0.02
"""Noise of the load that is added to that range, N; chosen."""


class TakeUp:
    """Tells when the load has been taken up.

    `has_load` is whether the object hung when it was over, and not only the time was up.
    """

    def __init__(self, start_ns: int) -> None:
        self._start_ns = start_ns
        self.has_load = False
        self._loads: deque[tuple[int, float]] = deque()
        self._seen_ns = self._slipped_ns = -1

    def wait(self, ns: int) -> None:
        """Leave out a time in which the arm waited."""
        self._start_ns += ns

    def step(self, now: Situation) -> bool:
        """Return whether it is over."""
        self._see(now)
        elapsed = now.t_ns - self._start_ns
        if elapsed < nanoseconds(LEAST_TAKE_UP_S) or now.t_ns - self._slipped_ns < nanoseconds(LOAD_STEADY_S):
            # An object that slips during a slow lift would slip faster in a fast one.
            return False
        forces = [force for _, force in self._loads]
        spans = self._loads and self._loads[-1][0] - self._loads[0][0] > nanoseconds(LOAD_STEADY_S - 0.1)
        # Before the arm has moved, nothing changes either.
        pulls = bool(forces) and forces[-1] > LEAST_EVIDENCE_N
        self.has_load = (
            pulls and bool(spans) and max(forces) - min(forces) < LOAD_STEADY_SHARE * max(forces) + LOAD_NOISE_N
        )
        return self.has_load or elapsed > nanoseconds(MOST_TAKE_UP_S)

    def _see(self, now: Situation) -> None:
        if now.cycle is None or now.cycle.t_ns == self._seen_ns:
            return
        self._seen_ns, grip = now.cycle.t_ns, now.cycle.grip
        if grip.sliding:
            self._slipped_ns = now.t_ns
        if not math.isfinite(grip.load_n) or grip.may_slide:
            self._loads.clear()
            return
        self._loads.append((now.cycle.t_ns, grip.load_n))
        while self._loads[-1][0] - self._loads[0][0] > nanoseconds(LOAD_STEADY_S):
            self._loads.popleft()
