"""Limit of the squeeze of a fragile object: by the normal force of its imprint, or by that of the hardest object."""

from __future__ import annotations

import math
from collections import deque
from statistics import median

HARDEST_OBJECT_N_M = 2350.0
"""Normal force over squeeze of the hardest object, N/m (simulated: 1700 to 2350 for flat faces, less for round
ones)."""
SAFE = 0.85
"""Share of the limit of a fragile object that is used, because imprint and ticks are inexact; chosen."""
STEEPNESS = 1.3
"""Exponent of the squeeze in the normal force of a round object; chosen between 1 (flat) and 1.5 (round contacts)."""
MEDIAN_OF_FRAMES = 5
"""Number of recent frames with a normal force by the imprint whose median stiffness counts; chosen."""


def allowed_squeeze_m(fragile_n: float, squeeze_m: float, normal_n: float) -> float:
    """Return the greatest squeeze (m) with at most `fragile_n` of normal force.

    `squeeze_m` is that of now and `normal_n` what is measured at it, NaN if nothing is.
    """
    if not math.isfinite(fragile_n):
        return math.inf
    force_n = normal_n if math.isfinite(normal_n) else HARDEST_OBJECT_N_M * squeeze_m
    share = SAFE * fragile_n / max(force_n, 1e-6)
    return squeeze_m * (share ** (1 / STEEPNESS) if share > 1 else share)


class Bearing:
    """The squeeze that an object withstands, over the frames of a grip: a flickering imprint must not change it."""

    def __init__(self) -> None:
        # Of each frame with a normal force: that force over squeeze to the power of `STEEPNESS`.
        self._stiffness: deque[float] = deque(maxlen=MEDIAN_OF_FRAMES)

    def take(self, squeeze_m: float, normal_n: float) -> None:
        """Take a frame: the squeeze (m), and the normal force by the imprint (N), NaN if none is known."""
        if math.isfinite(normal_n) and squeeze_m > 0:
            self._stiffness.append(normal_n / squeeze_m**STEEPNESS)

    def allowed_m(self, fragile_n: float, squeeze_m: float) -> float:
        """Return the greatest squeeze (m)."""
        by_imprint_n = median(self._stiffness) * squeeze_m**STEEPNESS if self._stiffness else math.nan
        return allowed_squeeze_m(fragile_n, squeeze_m, by_imprint_n)
