"""A load that jumps: somebody pushes, or something falls in. Or one that falls: the surface has got wet, and friction
carries less. Both are answered before a median or a detector could tell."""

from __future__ import annotations

import math
from collections import deque
from statistics import median

from lsds.clock import nanoseconds

CALM_S, CALM, LEAST_N = 0.3, 0.08, 0.05
"""A load that has changed by less than this share for this time, and is greater than that, is calm: a jump of it is no
noise."""
JUMP, LATE_S = 1.1, 0.3
"""A load above this factor of the calm one has jumped; what was calm counts for so long."""
LEAD_S, MOST_LED = 0.1, 1.5
"""A jump is followed so far ahead (a camera, a Hand-E and its way), at most by this factor."""
FELL, GONE = 0.67, 0.25
"""A load below the first share of the calm one has fallen; below the second, somebody took the object, or it stands. An
arm that brakes at 2 m/s^2 leaves 0.7 in one frame."""
RISE_S = 0.015
"""The rise is that over at least this time: two fingers may show it a millisecond apart."""
FALL_S = 0.05
"""The fall is that within this time, or since the last frame: two fingers may show it at any times of a frame."""


class LoadJump:
    """Watches one load; `fell` tells whether it has just fallen."""

    def __init__(self) -> None:
        self.fell = False
        self._recent: deque[tuple[int, float]] = deque()
        self._calm_n, self._calm_ns = math.nan, 0

    def see(self, t_ns: int, load_n: float) -> float:
        """Return where the load will be when the fingers answer, 0 where it has not jumped."""
        loads = [load for _, load in self._recent]
        spans = loads and t_ns - self._recent[0][0] >= nanoseconds(0.8 * CALM_S)
        if spans and min(loads) > LEAST_N and max(loads) - min(loads) < CALM * max(loads):
            self._calm_n, self._calm_ns = median(loads), t_ns
        late = t_ns - self._calm_ns <= nanoseconds(LATE_S)
        has_jumped = late and load_n > JUMP * self._calm_n
        # What is set down, or handed over, falls over some frames: only what falls in one has lost its friction.
        newest = [load for at, load in self._recent if t_ns - at <= nanoseconds(FALL_S)]
        at_once = max([*newest, *loads[-1:]], default=0.0) - load_n > (1 - FELL) * self._calm_n
        self.fell = late and at_once and GONE * self._calm_n < load_n < FELL * self._calm_n
        jumped_n = self._ahead(t_ns, load_n) if has_jumped else 0.0
        self._recent.append((t_ns, load_n))
        while t_ns - self._recent[0][0] > nanoseconds(CALM_S):
            self._recent.popleft()
        return jumped_n

    def _ahead(self, t_ns: int, load_n: float) -> float:
        before = [(at, load) for at, load in self._recent if t_ns - at >= nanoseconds(RISE_S)]
        if not before:
            return load_n
        at, load = before[-1]
        rise_n = max(load_n - load, 0.0) * LEAD_S / ((t_ns - at) * 1e-9)
        return min(load_n + rise_n, MOST_LED * load_n)
