"""Best rigid and affine motions of a field of vectors, by least squares, with lost markers left out.

A small rigid motion in the plane is v(x) = t + w * J x with J the quarter turn (x, y) -> (-y, x); an affine one is
v(x) = t + G x. div = tr G, curl = G_yx - G_xy = 2 w. Axes: x right, y down in the image, so a positive rotation
turns clockwise on the screen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class AffineMotion:
    """v(x) = `translation` + `gradient` (x - `centre`), (2,), (2, 2), (2,); `residual` (N, 2) is what is left."""

    translation: NDArray[np.float64]
    gradient: NDArray[np.float64]
    centre: NDArray[np.float64]
    residual: NDArray[np.float64]

    @property
    def divergence(self) -> float:
        """Trace of the gradient."""
        return float(self.gradient[0, 0] + self.gradient[1, 1])

    @property
    def curl(self) -> float:
        """Antisymmetric part: twice the rigid rotation."""
        return float(self.gradient[1, 0] - self.gradient[0, 1])


@dataclass(frozen=True, slots=True, eq=False)
class RigidMotion:
    """v(x) = `translation` + `rotation` * J (x - `centre`); `residual` (N, 2); `covariance` (3, 3) of (tx, ty, w).

    The covariance is that of independent errors with the residual's variance, and NaN below three markers. `radius`
    is the positions' radius of gyration: `radius` times `rotation` is the RMS speed of turning.
    """

    translation: NDArray[np.float64]
    rotation: float
    centre: NDArray[np.float64]
    residual: NDArray[np.float64]
    covariance: NDArray[np.float64]
    radius: float


def fit_affine(position: NDArray[np.float64], vector: NDArray[np.float64]) -> AffineMotion | None:
    """Fit vectors (N, 2) at positions (N, 2), all finite; None where the positions do not span the plane."""
    if len(position) < 3:
        return None
    centre = position.mean(axis=0)
    offset = position - centre
    moment = offset.T @ offset
    (a, b), (_, d) = moment.tolist()
    determinant = a * d - b * b
    if determinant <= 1e-12 * (a + d) ** 2:
        return None
    translation = vector.mean(axis=0)
    inverse = np.array([[d, -b], [-b, a]]) / determinant
    gradient = (vector.T @ offset) @ inverse
    return AffineMotion(translation, gradient, centre, vector - translation - offset @ gradient.T)


def fit_rigid(position: NDArray[np.float64], vector: NDArray[np.float64]) -> RigidMotion | None:
    """Fit vectors (N, 2) at positions (N, 2), all finite; None below two distinct positions."""
    count = len(position)
    if count < 2:
        return None
    centre = position.mean(axis=0)
    offset = position - centre
    inertia = float(np.einsum("ni,ni->", offset, offset))
    if inertia <= 0:
        return None
    translation = vector.mean(axis=0)
    turned = np.stack([-offset[:, 1], offset[:, 0]], axis=1)
    rotation = float(np.einsum("ni,ni->", turned, vector)) / inertia
    residual = vector - translation - rotation * turned
    degrees = 2 * count - 3
    variance = float(np.einsum("ni,ni->", residual, residual)) / degrees if degrees > 0 and count > 2 else np.nan
    covariance = np.diag([variance / count, variance / count, variance / inertia])
    return RigidMotion(translation, rotation, centre, residual, covariance, math.sqrt(inertia / count))
