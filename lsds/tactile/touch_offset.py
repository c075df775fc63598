"""Where the object begins, if the touch was noticed too early or too late: the normal force over the squeeze shows it.

The normal force of an elastic contact grows as (squeeze - offset)^power, whatever its stiffness. A touch that was
noticed too early (offset > 0) makes the squeeze look greater than it is, and its relative growth smaller; then the
friction limit seems to grow less than it does, and a grip is closed too far. Two or more squeezes with their normal
forces identify the offset.
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
MISTAKEN_SHARE = 0.05
"""Probability of a touch that is wrong by millimetres, late by a fast gripper or early on a worn gel; chosen."""
MISTAKEN_STD_M = 1e-3
"""Standard deviation of such a touch, and of one of which nothing is known, m; chosen."""
LEVEL_STD = 0.12
"""Relative scatter of the normal force of a squeeze about the power law; chosen: half as much again as the error of its
growth by the imprint (8 %, simulated)."""
MOST_MISFIT = 4.5
"""Maximum misfit of one squeeze, so that a wrong force does not decide: that of three standard deviations; chosen."""
MEAN_MISFIT = 0.5
"""Maximum mean misfit of the squeezes at which the power law holds: the expected one. Beyond it, as for foam or for
fingers that do not move, the offset stays as it is."""
SAME_M = 5e-5
"""Difference up to which two frames show the same squeeze, m; chosen."""
LEAST_FRAMES = 2
"""Minimum number of frames of a squeeze that counts; chosen: one frame alone may be wrong."""
ENOUGH_FRAMES = 5
"""Number of frames of a squeeze whose mean normal force counts; chosen."""
MOST_SQUEEZES = 24
"""Maximum number of squeezes that count; the first ones, at a light touch, say most; chosen."""
LEAST_BEYOND_M = 5e-5
"""Least squeeze beyond the offset at which there is a normal force, m; chosen."""


class TouchOffset:
    """Estimates the offset of one grip; `offset_m` is the most probable one (m), positive for an early touch.

    `power`: exponent by which the normal force grows with the squeeze.
    """

    def __init__(self, power: float) -> None:
        self.power = power
        self._offsets = np.arange(-MOST_M, MOST_M + STEP_M / 2, STEP_M)
        # Of each squeeze so far: the squeeze (m), the mean logarithm of its normal force, and the number of frames.
        self._levels: list[tuple[float, float, int]] = []
        self.offset_m = 0.0

    def take(self, squeeze_m: float, normal_n: float, touch_std_m: float) -> float:
        """Take a frame's squeeze (m) and normal force (N); return the most probable offset (m).

        `touch_std_m` is the standard deviation of the touch that the job states, NaN if it is not known. Frames without
        a normal force count nothing, nor do those of a squeeze that has shown `ENOUGH_FRAMES`.
        """
        if not (math.isfinite(squeeze_m) and 0 < normal_n < math.inf):
            return self.offset_m
        ln_normal = math.log(normal_n)
        near = (at for at, level in enumerate(self._levels) if abs(squeeze_m - level[0]) <= SAME_M)
        at = next(near, None)
        if at is None:
            if len(self._levels) < MOST_SQUEEZES:
                self._levels.append((squeeze_m, ln_normal, 1))
            return self.offset_m
        level_m, mean_ln, count = self._levels[at]
        if count < ENOUGH_FRAMES:
            self._levels[at] = level_m, mean_ln + (ln_normal - mean_ln) / (count + 1), count + 1
            self._estimate(max(touch_std_m, LEAST_STD_M) if touch_std_m >= 0 else MISTAKEN_STD_M)
        return self.offset_m

    def _estimate(self, touch_std_m: float) -> None:
        levels = [level for level in self._levels if level[2] >= LEAST_FRAMES]
        if len(levels) < 2:
            return
        squeezes, logs, _ = np.array(levels).T
        beyond = squeezes[:, None] - self._offsets
        stiffness = logs[:, None] - self.power * np.log(np.maximum(beyond, LEAST_BEYOND_M))
        misfit = 0.5 * ((stiffness - np.median(stiffness, axis=0)) / LEVEL_STD) ** 2
        # A force at a squeeze that has not reached the object is as wrong as one far from the power law.
        total = np.where(beyond < LEAST_BEYOND_M, MOST_MISFIT, np.minimum(misfit, MOST_MISFIT)).sum(axis=0)
        prior = (1 - MISTAKEN_SHARE) * _normal(self._offsets, touch_std_m) + MISTAKEN_SHARE * _normal(
            self._offsets, MISTAKEN_STD_M
        )
        at = int(np.argmin(total - np.log(prior)))
        # An offset at the end of the range is no explanation.
        if total.min() <= MEAN_MISFIT * len(levels) and 0 < at < len(total) - 1:
            self.offset_m = float(self._offsets[at])


def _normal(x: NDArray[np.float64], std: float) -> NDArray[np.float64]:
    return np.asarray(np.exp(-0.5 * (x / std) ** 2) / std)
