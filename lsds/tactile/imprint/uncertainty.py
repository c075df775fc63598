"""Uncertainty of an imprint's motion, from image noise and from the gel's motion between the markers.

The two errors add up. That of the registration is the inverse of its information times the variance of its residual.
The gel's motion under the object is interpolated from the markers around it, so a share of it is uncertain. That share,
and the factor for correlated errors of neighbouring pixels, were fitted on frames of real recordings without slip (a
Student distribution with four degrees of freedom, by maximum likelihood).
"""

from __future__ import annotations

import math
import sys
from functools import lru_cache
from statistics import median
from typing import TYPE_CHECKING

import numpy as np

from lsds.tactile.imprint.motion import RECENT

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from lsds.tactile.imprint.motion import ImprintMotion

    Floats = NDArray[np.float64]

Symmetric = tuple[float, float, float, float, float, float]
"""A symmetric matrix (3, 3) by rows, from the diagonal on."""

#: Factor on the variance of the reliefs' difference, since errors of neighbouring pixels are correlated.
CORRELATION_FACTOR = 4.3
#: Standard deviation of the gel's motion under the object, as a share of the markers' motion.
GEL_SHARE = 0.17
#: Degrees of freedom of the errors' distribution.
FREEDOM = 4
#: Minimum noise of the relief, RMS curvature: that of the camera.
LEAST_NOISE = 0.002
#: Standard deviation of the slip before the measurement, m; chosen.
PRIOR_STD_M = 2.5e-3
#: Standard deviation of the turn before the measurement, rad; chosen.
PRIOR_STD_RAD = 0.3
#: Jump of faint edges in a codec's key frame, m: a pixel.
KEY_FRAME_M = 6e-5
#: Standard deviation of faint edges at rest between frames, m: a fifth of a pixel of recorded video.
FAINT_STD_M = 1.25e-5
#: Number of results that are kept: several detectors and estimators ask for those of the last frames.
_KEPT = 64


def covariance(motion: ImprintMotion, share: float = GEL_SHARE, least_m: float = FAINT_STD_M) -> Floats:
    """Return the covariance (3, 3) of slip x, y (m) and turn (rad).

    The gel's motion is uncertain by `share` of the markers' motion, and by `least_m` at rest.
    """
    xx, xy, xt, yy, yt, tt = variances(motion, share, least_m)
    return np.array([[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]])


@lru_cache(maxsize=_KEPT)
def variances(motion: ImprintMotion, share: float, least_m: float = FAINT_STD_M) -> Symmetric:
    """Return the terms of `covariance`."""
    per = 1 / (CORRELATION_FACTOR * max(motion.residual, LEAST_NOISE) ** 2)
    (xx, xy, xt), (yx, yy, yt), (tx, ty, tt) = motion.information.tolist()
    xx, yy, tt = per * xx + PRIOR_STD_M**-2, per * yy + PRIOR_STD_M**-2, per * tt + PRIOR_STD_RAD**-2
    half = per / 2
    xx, xy, xt, yy, yt, tt = inverse((xx, half * (xy + yx), half * (xt + tx), yy, half * (yt + ty), tt))
    doubt = least_m**2 + (share * motion.dots_m) ** 2 + motion.redrawn * KEY_FRAME_M**2
    return xx + doubt, xy, xt, yy + doubt, yt, tt + doubt / motion.radius_m**2


def likelihood(motion: ImprintMotion, share: float = GEL_SHARE, least_m: float = FAINT_STD_M) -> float:
    """Return the log-likelihood of the motion if the imprint sticks, up to a constant.

    Errors are Student-distributed with `FREEDOM` degrees of freedom: a normal distribution gives too much weight to the
    few large ones.
    """
    spread = _spread(motion, share, least_m)
    size = math.log(max(_determinant(spread), sys.float_info.min))
    return -0.5 * size - 0.5 * (FREEDOM + 3) * math.log1p(_distance(_step(motion), spread) ** 2 / FREEDOM)


def step_m(motion: ImprintMotion) -> float:
    """Return the RMS motion of the imprint's edges against the gel, m: slip, and turn at the radius of gyration."""
    return math.hypot(*motion.slip_m, motion.turn_rad * motion.radius_m)


def distance(motion: ImprintMotion, share: float = GEL_SHARE) -> float:
    """Return the motion's distance from sticking, in standard deviations (Mahalanobis 1936)."""
    return _distance(_step(motion), _spread(motion, share))


def drift(recent: Sequence[ImprintMotion], share: float = GEL_SHARE, least_match: float = 0.5) -> tuple[float, float]:
    """Return the distance of the last frames' common motion from sticking, in standard deviations and in m.

    The common motion is the median times the number of frames. It suppresses a load that comes and goes, which moves
    the gel to and fro, and a slip that is over, which is one large step among small ones; slow slip continues. Both
    results are zero if fewer than `RECENT` frames are known, or if the imprint was lost in one of them (a match below
    `least_match`).
    """
    return _drift(tuple(recent), share, least_match)


@lru_cache(maxsize=_KEPT)
def _drift(recent: tuple[ImprintMotion, ...], share: float, least_match: float) -> tuple[float, float]:
    if len(recent) < RECENT or min(motion.match for motion in recent) < least_match:
        return 0.0, 0.0
    common = [median(parts) * len(recent) for parts in zip(*map(_step, recent), strict=True)]
    spreads = zip(*(_spread(motion, share) for motion in recent), strict=True)
    xx, xy, xt, yy, yt, tt = (sum(parts) * _MEDIAN_VARIANCE for parts in spreads)
    return _distance(common, (xx, xy, xt, yy, yt, tt)), math.hypot(*common)


#: Variance of a median relative to that of a mean, for normal errors.
_MEDIAN_VARIANCE = math.pi / 2


def _step(motion: ImprintMotion) -> tuple[float, float, float]:
    """Return slip x, y and turn as lengths (m); the turn is multiplied by the edges' radius."""
    return (*motion.slip_m, motion.turn_rad * motion.radius_m)


def _spread(motion: ImprintMotion, share: float, least_m: float = FAINT_STD_M) -> Symmetric:
    """Return the covariance of `_step`."""
    xx, xy, xt, yy, yt, tt = variances(motion, share, least_m)
    radius = motion.radius_m
    return xx, xy, xt * radius, yy, yt * radius, tt * radius * radius


def _distance(moved: Sequence[float], spread: Symmetric) -> float:
    xx, xy, xt, yy, yt, tt = inverse(spread)
    x, y, turn = moved
    return math.sqrt(max(0.0, x * (xx * x + 2 * xy * y + 2 * xt * turn) + y * (yy * y + 2 * yt * turn) + tt * turn**2))


def _determinant(matrix: Symmetric) -> float:
    xx, xy, xt, yy, yt, tt = matrix
    return xx * (yy * tt - yt * yt) + xy * (xt * yt - xy * tt) + xt * (xy * yt - xt * yy)


def inverse(matrix: Symmetric) -> Symmetric:
    """Return the inverse of a symmetric matrix (3, 3). Cofactors are ten times as fast as NumPy for this size."""
    xx, xy, xt, yy, yt, tt = matrix
    minor_xx, minor_xy, minor_xt = yy * tt - yt * yt, xt * yt - xy * tt, xy * yt - xt * yy
    per = 1 / (xx * minor_xx + xy * minor_xy + xt * minor_xt)
    minor_yy, minor_yt, minor_tt = xx * tt - xt * xt, xy * xt - xx * yt, xx * yy - xy * xy
    return minor_xx * per, minor_xy * per, minor_xt * per, minor_yy * per, minor_yt * per, minor_tt * per
