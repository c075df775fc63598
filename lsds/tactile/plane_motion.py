"""Rigid and smooth motions in the plane, with vectors as complex numbers x + iy: a few array operations per frame.

Multiplication by i is a quarter turn, so the rigid motion is v(z) = t + i w (z - c) and its rotation
w = Im sum conj(z - c) v / sum |z - c|^2. As y points down in the image, a positive w turns clockwise on the screen.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Plane = NDArray[np.complex128]


def as_complex(vectors: NDArray[np.float64]) -> Plane:
    """View vectors (N, 2) as (N,) complex numbers; no copy if they are contiguous."""
    return np.ascontiguousarray(vectors).view(np.complex128)[:, 0]


class Points:
    """N points of the plane with the terms of a fit to them, computed once for many frames.

    `offset` (N,) is their offset from the centroid, `inertia` the sum of its squares, `radius` the radius of gyration.
    """

    def __init__(self, position: Plane) -> None:
        self.count = len(position)
        self.offset = position - position.sum() / self.count
        self.inertia = float(np.vdot(self.offset, self.offset).real)
        self.radius = math.sqrt(self.inertia / self.count)

    def rigid_rows(self) -> Plane:
        """Return the matrix (2, N) of the best rigid motion; the points must not coincide.

        Its product with vectors (N,) is the translation and, as imaginary part, the rotation.
        """
        mean = np.full(self.count, 1.0 / self.count)
        return np.array([mean, self.offset.conj() / (self.inertia or 1.0)], np.complex128)

    def motion(self, translation: complex, rotation: float) -> Plane:
        """Return the rigid motion at the points, (N,)."""
        return np.asarray(translation + (1j * rotation) * self.offset)


def smooth_basis(offset: Plane, motion: Literal["affine", "quadratic"]) -> tuple[NDArray[np.float64], float]:
    """Return (N, terms) orthonormal columns that span the smooth fields at the offsets, and the residual's scale.

    The residual of a field v is v - B (B^T v), times sqrt(N / (N - terms)): its mean square then estimates the errors'
    variance for any number of markers. With too few markers for the terms, the simpler motion is used, and below five
    the mean. Columns that are dependent, as for markers in one line, are left out.
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
