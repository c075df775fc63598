"""Best affine motion of a vector field by least squares, without the lost markers.

v(x) = t + G x; div = tr G; curl = G_yx - G_xy, which is twice the rotation. The axes are x right and y down in the
image, so a positive rotation turns clockwise on the screen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class AffineMotion:
    """v(x) = `translation` (2,) + `gradient` (2, 2) (x - `centre` (2,)), with the fit's `residual` (N, 2)."""

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


def fit_affine(position: NDArray[np.float64], vector: NDArray[np.float64]) -> AffineMotion | None:
    """Fit vectors (N, 2) at positions (N, 2), all finite; None if the positions do not span the plane."""
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
