"""Rigid and smooth motions in the plane with x + iy for a vector: a handful of array operations a frame.

A quarter turn is multiplication by i, so the rigid motion is v(z) = t + i w (z - c) and its rotation
w = Im sum conj(z - c) v / sum |z - c|^2. y points down in the image: a positive w turns clockwise on the screen.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Plane = NDArray[np.complex128]


def as_complex(vectors: NDArray[np.float64]) -> Plane:
    """View vectors (N, 2) as (N,) complex numbers; no copy where they are contiguous."""
    return np.ascontiguousarray(vectors).view(np.complex128)[:, 0]


class Points:
    """N points of the plane, and what the fit of any motion to them needs: worked out once for many frames.

    `offset` (N,) from their centroid, `inertia` the sum of its squares, `radius` their radius of gyration.
    """

    def __init__(self, position: Plane) -> None:
        self.count = len(position)
        self.offset = position - position.sum() / self.count
        self.inertia = float(np.vdot(self.offset, self.offset).real)
        self.radius = math.sqrt(self.inertia / self.count)

    def rigid_rows(self) -> Plane:
        """Return (2, N): times vectors (N,) they give translation, and i times rotation, of the best rigid motion.

        The points must not coincide.
        """
        mean = np.full(self.count, 1.0 / self.count)
        return np.array([mean, self.offset.conj() / (self.inertia or 1.0)], np.complex128)

    def motion(self, translation: complex, rotation: float) -> Plane:
        """Return the rigid motion at the points, (N,)."""
        return np.asarray(translation + (1j * rotation) * self.offset)


def smooth_basis(offset: Plane, motion: Literal["affine", "quadratic"]) -> tuple[NDArray[np.float64], float]:
    """Return (N, terms) orthonormal columns that span the smooth fields at the offsets, and the residual's scale.

    What a field leaves is v - B (B^T v), times sqrt(N / (N - terms)), so that the residual's mean square estimates the
    errors' variance however many markers there are. Too few markers for the terms step down to the simpler motion,
    and below five to the mean; columns that markers in one line cannot tell apart are left out.
    """
    count = len(offset)
    scale = float(np.abs(offset).max()) or 1.0
    x, y = offset.real / scale, offset.imag / scale
    terms: tuple[NDArray[np.float64], ...] = ()
    if motion == "quadratic" and count >= 9:
        terms = (x, y, x * x, x * y, y * y)
    elif count >= 5:
        terms = (x, y)
    basis = np.stack([np.ones(count), *terms], axis=1)
    columns, size, _ = np.linalg.svd(basis, full_matrices=False)
    return columns[:, size > 1e-6 * size[0]], math.sqrt(count / max(1, count - basis.shape[1]))
