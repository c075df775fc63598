"""Rigid and smooth motions in the plane with x + iy for a vector: a handful of array operations a frame.

The per-frame path's form of `motion_fit`: a quarter turn is multiplication by i, so the rigid motion is
v(z) = t + i w (z - c) and its rotation w = Im sum conj(z - c) v / sum |z - c|^2.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Plane = NDArray[np.complex128]


class Rigid(NamedTuple):
    """A rigid motion of N points. `motion` (N,) is the motion at the points, `residual` (N,) what is left.

    `offset` (N,) are the points from their centroid, `radius` their radius of gyration.
    """

    translation: complex
    rotation: float
    offset: Plane
    radius: float
    motion: Plane
    residual: Plane


def as_complex(vectors: NDArray[np.float64]) -> Plane:
    """View vectors (N, 2) as (N,) complex numbers; no copy where they are contiguous."""
    return np.ascontiguousarray(vectors).view(np.complex128)[:, 0]


def rigid(position: Plane, vector: Plane) -> Rigid | None:
    """Fit vectors at positions, all finite; None where the positions coincide."""
    count = len(position)
    if count < 2:
        return None
    offset = position - position.sum() / count
    inertia = float(np.vdot(offset, offset).real)
    if inertia <= 0:
        return None
    translation = complex(vector.sum()) / count
    rotation = float(np.vdot(offset, vector).imag) / inertia
    motion = translation + (1j * rotation) * offset
    return Rigid(translation, rotation, offset, math.sqrt(inertia / count), motion, vector - motion)


def smooth_residual(offset: Plane, vector: Plane, motion: Literal["affine", "quadratic"]) -> Plane:
    """Return what the best affine or quadratic field leaves of the vectors (N,) at offsets (N,) from their centroid.

    Scaled by sqrt(N / (N - terms)), so that its mean square estimates the errors' variance however many markers there
    are. Too few markers for the terms step down to the simpler motion, and below five to the mean.
    """
    count = len(offset)
    scale = float(np.abs(offset).max()) or 1.0
    x, y = offset.real / scale, offset.imag / scale
    terms: tuple[NDArray[np.float64], ...] = ()
    if motion == "quadratic" and count >= 9:
        terms = (x, y, x * x, x * y, y * y)
    elif count >= 5:
        terms = (x, y)
    basis = np.empty((count, 1 + len(terms)))
    basis[:, 0] = 1.0
    for column, term in enumerate(terms, start=1):
        basis[:, column] = term
    normal = basis.T @ basis
    # A ridge far below any real moment keeps markers in one line from stopping the run.
    normal.ravel()[:: len(normal) + 1] += 1e-9 * count
    both = vector.view(np.float64).reshape(count, 2)
    coefficient = np.linalg.solve(normal, basis.T @ both)
    residual = both - basis @ coefficient
    residual *= math.sqrt(count / max(1, count - basis.shape[1]))
    return as_complex(residual)
