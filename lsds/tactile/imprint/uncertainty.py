"""How sure an imprint's motion is: what image noise leaves open, and what the dots leave open of the gel's motion.

Two errors add up. The registration's own is the inverse of its information, times the variance of what it left
unexplained. The gel's motion under the object is known from dots around it, so a share of it is in doubt; that share,
and the factor by which neighbouring pixels err together, were fitted on real recordings in frames in which nothing
slipped (a Student distribution with four degrees of freedom, by maximum likelihood).
"""

from __future__ import annotations

import math
from statistics import median
from typing import TYPE_CHECKING

import numpy as np

from lsds.tactile.imprint.motion import RECENT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lsds.tactile.imprint.motion import ImprintMotion

    Floats = NDArray[np.float64]

#: Variance of the difference of reliefs counts this much more than for independent pixels.
TOGETHER = 4.3
#: The gel's motion under the object is in doubt by this share of how far the dots have moved.
GEL_SHARE = 0.17
#: Degrees of freedom of the errors' distribution.
FREEDOM = 4
#: Least noise of the relief: what the camera adds.
LEAST_NOISE = 0.002
#: What is known of a slip before looking: standard deviations in m and rad.
WIDEST_M, WIDEST_RAD = 2.5e-3, 0.3
#: A codec's key frame makes faint edges jump by this much, m: a pixel.
KEY_FRAME_M = 6e-5
#: Faint edges tremble by this much from frame to frame where nothing moves, m: a fifth of a pixel of recorded video.
LEAST_M = 1.25e-5


def covariance(motion: ImprintMotion, share: float = GEL_SHARE, least_m: float = LEAST_M) -> Floats:
    """Return the covariance (3, 3) of slip x, y (m) and turn (rad).

    `share` of the dots' motion is in doubt, and `least_m` where nothing moves.
    """
    per = 1 / (TOGETHER * max(motion.residual, LEAST_NOISE) ** 2)
    (xx, xy, xt), (yx, yy, yt), (tx, ty, tt) = (motion.information * per).tolist()
    xx, yy, tt = xx + WIDEST_M**-2, yy + WIDEST_M**-2, tt + WIDEST_RAD**-2
    xx, xy, xt, yy, yt, tt = _inverse(xx, (xy + yx) / 2, (xt + tx) / 2, yy, (yt + ty) / 2, tt)
    doubt = least_m**2 + (share * motion.dots_m) ** 2 + motion.redrawn * KEY_FRAME_M**2
    return np.array([[xx + doubt, xy, xt], [xy, yy + doubt, yt], [xt, yt, tt + doubt / motion.radius_m**2]])


def likelihood(motion: ImprintMotion, share: float = GEL_SHARE, least_m: float = LEAST_M) -> float:
    """Return the logarithm of the density of the motion where the imprint sticks, but for a constant.

    Errors are Student-distributed with `FREEDOM` degrees of freedom: a normal distribution makes too much of the few
    large ones.
    """
    spread = _spread(motion, share, least_m)
    size = np.linalg.slogdet(spread)[1]
    return float(-0.5 * size - 0.5 * (FREEDOM + 3) * math.log1p(_distance(_step(motion), spread) ** 2 / FREEDOM))


def step_m(motion: ImprintMotion) -> float:
    """Return how far the imprint's edges have moved against the gel: slip and turn at their radius of gyration, RMS."""
    return math.hypot(*motion.slip_m, motion.turn_rad * motion.radius_m)


def distance(motion: ImprintMotion, share: float = GEL_SHARE) -> float:
    """Return how far the motion is from sticking, in standard deviations (Mahalanobis 1936)."""
    return _distance(_step(motion), _spread(motion, share))


def drift(recent: Sequence[ImprintMotion], share: float = GEL_SHARE, least_match: float = 0.5) -> tuple[float, float]:
    """Return how far the motions of the last frames have led from sticking, in standard deviations, and in m.

    What all have in common is their median, times their number. A load that comes and goes moves the gel to and fro,
    and a slip that is over was one large step among small ones; but a slow slide goes on. Both zero where fewer than
    `RECENT` frames are known, or the imprint was lost in one of them (a match below `least_match`).
    """
    if len(recent) < RECENT or min(motion.match for motion in recent) < least_match:
        return 0.0, 0.0
    steps = [_step(motion).tolist() for motion in recent]
    common = np.array([median(parts) for parts in zip(*steps, strict=True)]) * len(recent)
    spread = sum((_spread(motion, share) for motion in recent), np.zeros((3, 3)))
    return _distance(common, spread * _MEDIAN), math.sqrt(float(common @ common))


#: Variance of a median relative to that of a mean, for normal errors.
_MEDIAN = math.pi / 2


def _step(motion: ImprintMotion) -> Floats:
    """Return slip x, y and turn, all as lengths (m): a turn moves the edges at their radius."""
    return np.array([*motion.slip_m, motion.turn_rad * motion.radius_m])


def _spread(motion: ImprintMotion, share: float, least_m: float = LEAST_M) -> Floats:
    """Return the covariance of that."""
    spread = covariance(motion, share, least_m)
    spread[2] *= motion.radius_m
    spread[:, 2] *= motion.radius_m
    return spread


def _distance(moved: Floats, spread: Floats) -> float:
    (xx, xy, xt), (_, yy, yt), (_, _, tt) = spread.tolist()
    xx, xy, xt, yy, yt, tt = _inverse(xx, xy, xt, yy, yt, tt)
    x, y, turn = moved.tolist()
    return math.sqrt(max(0.0, x * (xx * x + 2 * xy * y + 2 * xt * turn) + y * (yy * y + 2 * yt * turn) + tt * turn**2))


def _inverse(
    xx: float, xy: float, xt: float, yy: float, yt: float, tt: float
) -> tuple[float, float, float, float, float, float]:
    """Return the inverse of a symmetric matrix (3, 3), both by rows from the diagonal on.

    By cofactors: NumPy's takes ten times as long for so few numbers.
    """
    minor_xx, minor_xy, minor_xt = yy * tt - yt * yt, xt * yt - xy * tt, xy * yt - xt * yy
    per = 1 / (xx * minor_xx + xy * minor_xy + xt * minor_xt)
    minor_yy, minor_yt, minor_tt = xx * tt - xt * xt, xy * xt - xx * yt, xx * yy - xy * xy
    return minor_xx * per, minor_xy * per, minor_xt * per, minor_yy * per, minor_yt * per, minor_tt * per
