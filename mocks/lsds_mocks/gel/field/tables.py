"""Periodic tables of the bonded layer: what one loaded cell does to another cell, and to a point of the surface.

A cell's traction is constant, so its transform is a sinc; a cell's displacement is a mean, another sinc. Waves too
short for a table's spacing fold back onto its own; adding them up makes it the table of true rectangles.
The symbol is in `lsds_mocks.gel.field.symbol`.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from lsds_mocks.gel.field.symbol import layer_symbol

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.grid import HatGrid

_CELL_FOLDS = 5
_POINT_FOLDS = 2
POINT_FINE = 16
"""Points of the cell-to-point table per hat interval: 0.06 mm, between which it is interpolated. Sheared surface bends
sharply at the edge of a load: from points 0.12 mm apart, dots beside one were off by 0.8 % of the greatest motion."""


@njit(cache=True)  # type: ignore[untyped-decorator]
def _folded(
    nx: int, ny: int, hx: float, hy: float, dx: float, dy: float, power: int, poisson: float, folds: int
) -> NDArray[np.complex128]:
    """Return (3, 3, ny, nx / 2 + 1), G u_a of t_b on points `hx`, `hy` apart, for cells `dx`, `dy` large."""
    half = nx // 2 + 1
    out = np.zeros((3, 3, ny, half), np.complex128)
    for ky in range(ny // 2 + 1):
        for kx in range(half):
            s = np.zeros(6)
            # The wave at a band's end has one image less, so that the images lie evenly about zero.
            for fy in range(-folds, folds + (0 if 2 * ky == ny else 1)):
                qy = 2 * math.pi * (ky + fy * ny) / (ny * hy)
                sy = 1.0 if qy == 0 else math.sin(0.5 * qy * dy) / (0.5 * qy * dy)
                for fx in range(-folds, folds + (0 if 2 * kx == nx else 1)):
                    qx = 2 * math.pi * (kx + fx * nx) / (nx * hx)
                    sx = 1.0 if qx == 0 else math.sin(0.5 * qx * dx) / (0.5 * qx * dx)
                    weight = (sx * sy) ** power
                    for part, value in enumerate(layer_symbol(qx, qy, poisson)):
                        s[part] += weight * value
            for row, sign in ((ky, 1.0), ((ny - ky) % ny, -1.0)):  # qy and -qy
                out[0, 0, row, kx], out[1, 1, row, kx], out[2, 2, row, kx] = s[0], s[2], s[3]
                out[0, 1, row, kx] = out[1, 0, row, kx] = sign * s[1]
                out[0, 2, row, kx], out[2, 0, row, kx] = 1j * s[4], -1j * s[4]
                out[1, 2, row, kx], out[2, 1, row, kx] = sign * 1j * s[5], -sign * 1j * s[5]
    return out


@lru_cache(maxsize=8)
def cell_symbol(hats: HatGrid, fine: int, poisson: float) -> NDArray[np.complex128]:
    """Return (3, 3, Ny, Nx / 2 + 1), the transform of `cell_table`."""
    dx, dy = hats.pitch_x / fine, hats.pitch_y / fine
    shape = (hats.period_x * fine, hats.period_y * fine, dx, dy, dx, dy, 2, poisson)
    few, many = (_folded(*shape, folds) for folds in (_CELL_FOLDS, 2 * _CELL_FOLDS))
    # What is left out falls with the square of the folds (Richardson).
    return np.asarray((4 * many - few) / 3)


@lru_cache(maxsize=8)
def cell_table(hats: HatGrid, fine: int, poisson: float) -> NDArray[np.float32]:
    """Return (3, 3, Ny, Nx): mean displacement of a cell, in thicknesses, under traction G in the cell at (0, 0)."""
    return _back(cell_symbol(hats, fine, poisson))


@lru_cache(maxsize=8)
def point_table(hats: HatGrid, fine: int, poisson: float) -> NDArray[np.float32]:
    """Return (2, 3, Ny, Nx): displacement x, y, in thicknesses, of points at multiples of hat/`POINT_FINE` from the
    centre of a cell under traction G."""
    nx, ny = hats.period_x * POINT_FINE, hats.period_y * POINT_FINE
    hx, hy = hats.pitch_x / POINT_FINE, hats.pitch_y / POINT_FINE
    symbol = _folded(nx, ny, hx, hy, hats.pitch_x / fine, hats.pitch_y / fine, 1, poisson, _POINT_FOLDS)[:2]
    # Density of points over density of cells: the transform of one cell's traction is its area.
    return _back(symbol * (POINT_FINE / fine) ** 2)


def _back(symbol: NDArray[np.complex128]) -> NDArray[np.float32]:
    columns = 2 * (symbol.shape[-1] - 1)
    return np.ascontiguousarray(np.fft.irfft2(symbol, s=(symbol.shape[-2], columns)), np.float32)
