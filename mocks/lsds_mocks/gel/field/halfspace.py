"""The half-space: what a loaded rectangle does to the surface of a very thick gel, in closed form.

Boussinesq and Cerruti, integrated over a rectangle (Love 1929; Johnson, Contact Mechanics, 3.25). Wrong for a gel
bonded to its base (even in sign: it draws markers toward the contact), but the case that analytic solutions exist for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.gel.field.tables import POINT_FINE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.grid import CellGrid

_GAUSS = 6


def rectangle(
    x: NDArray[np.float64], y: NDArray[np.float64], dx: float, dy: float, poisson: float
) -> NDArray[np.float64]:
    """Return (3, 3, ...): G times the displacement at (x, y) of a rectangle dx by dy about the origin under traction 1.

    Rows u_x, u_y, u_z (into the gel), columns t_x, t_y, p.
    """
    inverse, xx, yy, xy, x_r2, y_r2 = (np.zeros(np.broadcast(x, y).shape) for _ in range(6))
    for ex, ey, sign in ((0.5, 0.5, 1), (-0.5, 0.5, -1), (0.5, -0.5, -1), (-0.5, -0.5, 1)):
        a, b = x + ex * dx, y + ey * dy
        r = np.hypot(a, b)
        # Points on an edge's line: the limits are finite, and a tiny offset finds them.
        a, b = np.where(a == 0, 1e-12 * dx, a), np.where(b == 0, 1e-12 * dy, b)
        along_y, along_x = b * np.arcsinh(a / np.abs(b)), a * np.arcsinh(b / np.abs(a))
        inverse += sign * (along_x + along_y)
        xx += sign * along_y
        yy += sign * along_x
        xy -= sign * r
        log = 0.5 * np.log(a * a + b * b)
        x_r2 += sign * (a * np.arctan(b / a) + b * log)
        y_r2 += sign * (b * np.arctan(a / b) + a * log)
    out = np.empty((3, 3, *inverse.shape))
    out[0, 0] = ((1 - poisson) * inverse + poisson * xx) / (2 * np.pi)
    out[1, 1] = ((1 - poisson) * inverse + poisson * yy) / (2 * np.pi)
    out[0, 1] = out[1, 0] = poisson * xy / (2 * np.pi)
    out[2, 2] = (1 - poisson) * inverse / (2 * np.pi)
    out[0, 2] = -(1 - 2 * poisson) * x_r2 / (4 * np.pi)
    out[1, 2] = -(1 - 2 * poisson) * y_r2 / (4 * np.pi)
    out[2, 0], out[2, 1] = -out[0, 2], -out[1, 2]
    return out


def halfspace_tables(grid: CellGrid) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return what `Operator` calls `cells` and `points`, wrapping round at twice the pad's size."""
    dx, dy, poisson = grid.dx_m, grid.dy_m, grid.material.poisson
    nodes, weights = np.polynomial.legendre.leggauss(_GAUSS)
    x, y = (_wrapped(2 * n) * d for n, d in ((grid.columns, dx), (grid.rows, dy)))
    cells = np.zeros((3, 3, len(y), len(x)))
    for node_y, weight_y in zip(nodes, weights, strict=True):
        for node_x, weight_x in zip(nodes, weights, strict=True):
            at = rectangle(x + 0.5 * node_x * dx, (y + 0.5 * node_y * dy)[:, None], dx, dy, poisson)
            cells += 0.25 * weight_x * weight_y * at
    step = POINT_FINE // grid.fine
    px, py = (_wrapped(2 * n * step) * d / step for n, d in ((grid.columns, dx), (grid.rows, dy)))
    points = rectangle(px, py[:, None], dx, dy, poisson)[:2]
    shear = grid.material.shear_modulus_pa
    return (cells / shear).astype(np.float32), (points / shear).astype(np.float32)


def _wrapped(size: int) -> NDArray[np.float64]:
    """Return 0, 1, ... size / 2 - 1, -size / 2, ... -1."""
    return np.asarray(np.fft.fftfreq(size, 1 / size))
