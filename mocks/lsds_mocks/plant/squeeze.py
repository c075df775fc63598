"""Normal force from the fingers' closure: gel and finger in series, alike on both sides."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds_mocks.gel.protocol import GelModel

_BISECTIONS = 80
"""Maximum number of trials in the search for the gel's indentation; chosen."""
_SQUEEZE_TOLERANCE_M = 1e-13
"""Residual of the closure at which the search ends, m; chosen."""


class Squeeze:
    """One finger of stiffness `finger_n_m` on a gel; each search starts from the last solution."""

    def __init__(self, gel: GelModel, finger_n_m: float) -> None:
        self._gel = gel
        self._stiffness = finger_n_m
        self.depth_m = self.deepest_m = 0.0
        self.normal_n = 0.0
        self._slope = 2.0

    def is_off(self, closure_m: float, normal_n: float) -> bool:
        """Return whether sliding has changed the gel's normal force away from the finger's."""
        return abs(self._excess(closure_m, normal_n)) > 5 * self._tolerance(normal_n)

    def _excess(self, closure_m: float, normal_n: float) -> float:
        return self.depth_m + normal_n / self._stiffness - closure_m

    def _tolerance(self, normal_n: float) -> float:
        return self._gel.force_tolerance * normal_n / self._stiffness + _SQUEEZE_TOLERANCE_M

    def close(self, closure_m: float, reach_m: tuple[float, float] | None) -> float:
        """Close by `closure_m` beyond first touch; return the normal force (N).

        Solves d + N(d) / k = closure for the gel's increasing law N(d) by a bracketing secant method (Illinois).
        """
        if closure_m <= 0:
            self.depth_m = 0.0
            self.normal_n = self._gel.press(0.0, reach_m)
            return self.normal_n
        low, high, below, above = 0.0, closure_m, -closure_m, 0.0
        depth = self.depth_m if 0 < self.depth_m < closure_m else closure_m / self._slope
        last = 0
        for _ in range(_BISECTIONS):
            self.depth_m = depth
            self.normal_n = self._gel.press(depth, reach_m)
            excess = self._excess(closure_m, self.normal_n)
            if abs(excess) <= self._tolerance(self.normal_n):
                break
            if excess > 0:
                high, above, below = depth, excess, below / 2 if last > 0 else below
            else:
                low, below, above = depth, excess, above / 2 if last < 0 else above
            last = 1 if excess > 0 else -1
            if high - low <= self._gel.force_tolerance * closure_m:
                break
            if above > 0:
                self._slope = (above - below) / (high - low)
                depth = low - below / self._slope
            else:
                depth = min(depth - excess / self._slope, closure_m)
        self.deepest_m = max(self.deepest_m, self.depth_m)
        return self.normal_n
