"""How far the touch lies from where it was noticed: the normal force by the imprint, over the squeeze, shows it.

The normal force of an elastic contact grows as (squeeze - offset)^power. A touch that was noticed too early makes the
squeeze look greater than it is, and its growth smaller; then the friction limit seems to grow less than it does, and a
grip is closed too far. Two or more squeezes with their normal forces identify the offset; their common factor, the
stiffness, does not matter.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

MOST_M = 2e-3
"""Largest offset that is considered, either way, m; chosen: the way of a gripper between two slow frames."""
STEP_M = 5e-5
"""Spacing of the offsets that are compared, m; chosen below the ticks of a gripper."""
LEAST_STD_M = 1.5e-4
"""Standard deviation of a touch that was noticed as intended, m: on the objects of the catalogue it is right within
that, flat and smooth ones excepted (simulated), and those have no normal force."""
MISTAKEN = 0.05
"""Probability of a touch that is wrong by millimetres, late by a fast gripper or early on a worn gel; chosen."""
MISTAKEN_STD_M = 1e-3
"""Standard deviation of such a touch, m; chosen."""
LEVEL_STD = 0.12
"""Relative scatter of the normal force of a squeeze about the power law; chosen: half as much again as the error of the
imprint's estimate (8 %, simulated)."""
SAME_M = 5e-5
"""Difference up to which two frames show the same squeeze, m; chosen."""
ENOUGH_FRAMES = 5
"""Number of frames of a squeeze whose mean normal force counts; chosen."""
MOST_LEVELS = 24
"""Number of squeezes that are remembered; chosen."""
LEAST_BEYOND_M = 5e-5
"""Least squeeze beyond the offset at which there is a normal force, m; chosen."""


class TouchOffset:
    """Estimates the offset of one grip. `power`: exponent by which the normal force grows with the squeeze."""

    def __init__(self, power: float) -> None:
        self._power = power
        self._offsets = np.arange(-MOST_M, MOST_M + STEP_M / 2, STEP_M)
        # Mean squeeze (m), mean logarithm of its normal force, and number of frames, of each squeeze so far.
        self._levels: list[tuple[float, float, int]] = []
        self.expected_m = 0.0

    def take(self, squeeze_m: float, normal_n: float, touch_std_m: float) -> float:
        """Take a frame's squeeze (m) and normal force (N); return the expected offset (m).

        `touch_std_m` is the standard deviation of the touch that the job states. Frames without a normal force, and
        further ones of a squeeze that is known, are left out.
        """
        if not (math.isfinite(squeeze_m) and 0 < normal_n < math.inf):
            return self.expected_m
        ln_normal = math.log(normal_n)
        near = (at for at, level in enumerate(self._levels) if abs(squeeze_m - level[0]) <= SAME_M)
        at = next(near, None)
        if at is None:
            self._levels = [*self._levels, (squeeze_m, ln_normal, 1)][-MOST_LEVELS:]
        else:
            mean_m, mean_ln, count = self._levels[at]
            if count >= ENOUGH_FRAMES:
                return self.expected_m
            self._levels[at] = mean_m, mean_ln + (ln_normal - mean_ln) / (count + 1), count + 1
        if len(self._levels) > 1:
            self.expected_m = self._expected(max(touch_std_m, LEAST_STD_M) if touch_std_m > 0 else MISTAKEN_STD_M)
        return self.expected_m

    def _expected(self, touch_std_m: float) -> float:
        squeezes, logs, _ = np.array(self._levels).T
        beyond = squeezes[:, None] - self._offsets
        possible = beyond.min(axis=0) >= LEAST_BEYOND_M
        if not possible.any():
            return self.expected_m
        stiffness = logs[:, None] - self._power * np.log(np.maximum(beyond, LEAST_BEYOND_M))
        misfit = 0.5 * ((stiffness - stiffness.mean(axis=0)) ** 2).sum(axis=0) / LEVEL_STD**2
        prior = (1 - MISTAKEN) * _normal(self._offsets, touch_std_m) + MISTAKEN * _normal(self._offsets, MISTAKEN_STD_M)
        misfit = np.where(possible, misfit, math.inf)
        weights = prior * np.exp(misfit.min() - misfit)
        return float(weights @ self._offsets / weights.sum())


def _normal(x: NDArray[np.float64], std: float) -> NDArray[np.float64]:
    return np.asarray(np.exp(-0.5 * (x / std) ** 2) / std)
