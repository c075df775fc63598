"""Elastic response of a pad's surface: displacement of cells and of surface points per traction in one cell.

**Bonded layer.** A sinusoidal traction moves the surface of an elastic layer on a rigid base by plane strain in the
wave's direction and antiplane strain across it. z points into the gel, p > 0 presses. With x = q h and
D = (3-4v) cosh 2x + 2x^2 + 5 - 12v + 8v^2 the compliances are

    zz   (1-v) [(3-4v) sinh 2x - 2x] / (G q D)        pressure to depth
    par  (1-v) [(3-4v) sinh 2x + 2x] / (G q D)        shear along the wave to motion along it
    perp tanh x / (G q)                               shear across the wave
    c    [(1-2v)(3-4v)(cosh 2x - 1) - 2x^2] / (2GqD)  pressure to motion along the wave, times i

and h/M, h/G, h/G, 0 at q = 0, M = 2G (1-v)/(1-2v). Everything is scaled by e^-2x, so nothing overflows. Short waves
respond like a half-space, long ones like a Winkler foundation. In the code G = 1 and h = 1: multiply by h/G.

The tables are periodic. A cell's traction is constant, so its transform is a sinc; a cell's displacement is a mean,
another sinc. Waves too short for a table's spacing alias; adding them up yields the table of exact rectangles.

**Half-space.** Boussinesq and Cerruti, integrated over a rectangle (Love 1929; Johnson, Contact Mechanics, 3.25). It is
wrong for a gel bonded to its base, even in sign (it draws markers toward the contact), but analytic solutions exist for
it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numba import njit

from lsds_mocks.byte_cache import kept
from lsds_mocks.gel.field.correction import pad_correction
from lsds_mocks.gel.field.grid import CellGrid

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.grid import CellGrid, HatGrid
    from lsds_mocks.gel.material import GelMaterial


#: x = q h beyond which the base has no effect: e^-60 is negligible in double precision.
_DEEP = 30.0


@njit(cache=True)  # type: ignore[untyped-decorator]
def layer_symbol(qx: float, qy: float, poisson: float) -> tuple[float, float, float, float, float, float]:
    """Return xx, xy, yy, zz (real) and xz, yz (to be multiplied by i) for a wave (qx, qy) in units of 1/h."""
    x = math.hypot(qx, qy)
    if x == 0.0:
        return 1.0, 0.0, 1.0, 0.5 * (1 - 2 * poisson) / (1 - poisson), 0.0, 0.0
    deep = min(x, _DEEP)
    e = math.exp(-2 * deep)
    cosh, sinh = 0.5 * (1 + e * e), 0.5 * (1 - e * e)
    k = 3 - 4 * poisson
    scale = 1 / (x * (k * cosh + (2 * deep * deep + 5 - 12 * poisson + 8 * poisson * poisson) * e))
    zz = (1 - poisson) * (k * sinh - 2 * deep * e) * scale
    par = (1 - poisson) * (k * sinh + 2 * deep * e) * scale
    perp = math.tanh(deep) / x
    cross = 0.5 * ((1 - 2 * poisson) * k * (cosh - e) - 2 * deep * deep * e) * scale
    cx, cy = qx / x, qy / x
    return (
        par * cx * cx + perp * cy * cy,
        (par - perp) * cx * cy,
        par * cy * cy + perp * cx * cx,
        zz,
        cross * cx,
        cross * cy,
    )


_CELL_FOLDS = 5
"""Aliased images per side that are added up in the cell-to-cell table."""
_POINT_FOLDS = 2
"""Aliased images per side that are added up in the cell-to-point table."""
POINT_FINE = 16
"""Points of the cell-to-point table per hat interval: 0.06 mm apart, interpolated in between. A sheared surface bends
sharply at the edge of a load: with points 0.12 mm apart, markers next to an edge were off by 0.8 % of the greatest
motion."""


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


@kept
def cell_symbol(hats: HatGrid, fine: int, poisson: float) -> NDArray[np.complex128]:
    """Return (3, 3, Ny, Nx / 2 + 1), the transform of `cell_table`."""
    dx, dy = hats.pitch_x / fine, hats.pitch_y / fine
    shape = (hats.period_x * fine, hats.period_y * fine, dx, dy, dx, dy, 2, poisson)
    few, many = (_folded(*shape, folds) for folds in (_CELL_FOLDS, 2 * _CELL_FOLDS))
    # The truncation error falls with the square of the folds (Richardson extrapolation).
    return np.asarray((4 * many - few) / 3)


@kept
def cell_table(hats: HatGrid, fine: int, poisson: float) -> NDArray[np.float32]:
    """Return (3, 3, Ny, Nx): mean displacement of a cell, in thicknesses, under traction G in the cell at (0, 0)."""
    return _back(cell_symbol(hats, fine, poisson))


@kept
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


_OPERATOR_POINTS = 6
"""Number of Gauss-Legendre points per axis over which a cell's displacement is averaged; chosen."""


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
        # On the line of an edge the limits are finite; a tiny offset yields them.
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
    """Return `cells` and `points` of an `Operator` for a half-space, periodic in twice the pad's size."""
    dx, dy, poisson = grid.dx_m, grid.dy_m, grid.material.poisson
    nodes, weights = np.polynomial.legendre.leggauss(_OPERATOR_POINTS)
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
    return np.asarray(np.fft.fftfreq(size, 1 / size), np.float64)


Kernel = Literal["half-space", "layer", "pad"]


@dataclass(frozen=True, eq=False)
class Operator:
    """`cells` (3, 3, Ny, Nx) and `points` (2, 3, Ny8, Nx8) in metres per pascal, periodic in their last two axes;
    `correction` (3, nodes, 3, nodes), metres per pascal in a cell, of size 0 where the kernel has none."""

    grid: CellGrid
    kernel: Kernel
    cells: NDArray[np.float32]
    points: NDArray[np.float32]
    correction: NDArray[np.float32]


@kept
def operator(material: GelMaterial, fine: int, kernel: Kernel) -> Operator:
    """Return the operator for a grid of `fine` cells per hat.

    Raises DataError if the kernel is `pad` and there is no correction for this pad.
    """
    grid = CellGrid(material, fine)
    none = np.zeros((3, 0, 3, 0), np.float32)
    if kernel == "half-space":
        return Operator(grid, kernel, *halfspace_tables(grid), none)
    # The correction comes first: it may be missing, and the tables take long.
    correction = pad_correction(material) * np.float32(grid.cell_m2) if kernel == "pad" else none
    softness = np.float32(material.thickness_m / material.shear_modulus_pa)
    cells = softness * cell_table(grid.hats, fine, material.poisson)
    points = softness * point_table(grid.hats, fine, material.poisson)
    return Operator(grid, kernel, cells, points, correction)
