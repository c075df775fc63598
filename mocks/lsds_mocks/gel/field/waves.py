"""The elastic layer's response over a rectangle of cells, by sines and cosines.

The layer's table becomes one number, or a few, per wave. Cells outside the rectangle carry no traction, so a table
with a period of 2 n - 1 cells acts on n of them like the whole one; if the layer's own period is shorter, that is
used. Along one axis, an even table maps cosine to cosine and sine to sine; an odd table maps cosine to sine and sine
to minus cosine. All numbers are therefore real, and the transform is a product with a small matrix on each side. At
these sizes, and without rounding up to a fast length, that costs no more than a fast Fourier transform, and a third
of it on small rectangles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from lsds_mocks.byte_cache import kept

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.operator import Operator

_LEAST_COMPLIANCE = 0.3
"""Least compliance that is inverted, as part of the shortest wave's; a truncated table may dip below zero."""


@dataclass(frozen=True, eq=False)
class Waves:
    """Waves over `rows` x `columns` cells: `down` (2 Hy, rows) and `across` (2 Hx, columns), cosines above sines,
    orthonormal over the period. `symbol` and `inverse` (6, Hy, Hx) are what `multiply` takes, in metres per pascal and
    pascal per metre."""

    down: NDArray[np.float32]
    across: NDArray[np.float32]
    symbol: NDArray[np.float32]
    inverse: NDArray[np.float32]


@kept
def waves(operator: Operator, rows: int, columns: int) -> Waves:
    """Return the waves over a rectangle, anywhere on the pad, of an operator without its correction."""
    ny, nx = operator.cells.shape[2:]
    down, cos_y, sin_y, at_y = _axis(rows, ny)
    across, cos_x, sin_x, at_x = _axis(columns, nx)
    table = operator.cells[:, :, at_y][:, :, :, at_x].astype(np.float64)
    symbol = np.stack(
        [
            cos_y @ table[0, 0] @ cos_x.T,
            sin_y @ table[0, 1] @ sin_x.T,
            cos_y @ table[1, 1] @ cos_x.T,
            cos_y @ table[2, 2] @ cos_x.T,
            cos_y @ table[0, 2] @ sin_x.T,
            sin_y @ table[1, 2] @ cos_x.T,
        ]
    )
    return Waves(down, across, symbol.astype(np.float32), _inverse(symbol).astype(np.float32))


def _axis(
    cells: int, period: int
) -> tuple[NDArray[np.float32], NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Return the waves over cells (2 H, cells); cosines and sines (H, offsets) over a table's offsets; these."""
    repeat = min(period, 2 * cells - 1)
    offset = np.arange(repeat) if repeat == period else np.arange(1 - cells, cells)
    number = np.arange(repeat // 2 + 1)
    # The constant, and the shortest wave of an even period, have no sine: its row is zero.
    size = np.sqrt(np.where((number == 0) | (2 * number == repeat), 1.0, 2.0) / repeat)[:, None]
    angle = 2 * np.pi / repeat * np.outer(number, np.arange(cells))
    wave = np.concatenate([size * np.cos(angle), size * np.sin(angle)]).astype(np.float32)
    angle = 2 * np.pi / repeat * np.outer(number, offset)
    return wave, np.cos(angle), np.sin(angle), offset % period


def _inverse(symbol: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the symbol of the inverse: waves in quadrature, so three by three numbers that are real and symmetric."""
    xx, xy, yy, zz, xz, yz = symbol
    matrix = np.stack([xx, -xy, xz, -xy, yy, yz, xz, yz, zz], axis=-1).reshape(*xx.shape, 3, 3)
    value, vector = np.linalg.eigh(matrix)
    value = np.maximum(value, _LEAST_COMPLIANCE * abs(value[-1, -1, 0]))
    back = np.einsum("...ik,...k,...jk->ij...", vector, 1 / value, vector)
    return np.stack([back[0, 0], -back[0, 1], back[1, 1], back[2, 2], back[0, 2], back[1, 2]])


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def multiply(symbol: NDArray[np.float32], t: NDArray[np.float32]) -> None:
    """Turn waves of traction `t` (3, 2 Hy, 2 Hx) into waves of displacement, in place.

    `symbol` (6, Hy, Hx): xx, yy and zz are even along both axes, xy is odd along both, xz along x, yz along y.
    """
    hy, hx = symbol.shape[1], symbol.shape[2]
    for i in range(hy):
        xx, xy, yy, zz, xz, yz = symbol[0, i], symbol[1, i], symbol[2, i], symbol[3, i], symbol[4, i], symbol[5, i]
        # Cosine or sine along y, then along x.
        x_cc, x_cs, x_sc, x_ss = t[0, i, :hx], t[0, i, hx:], t[0, hy + i, :hx], t[0, hy + i, hx:]
        y_cc, y_cs, y_sc, y_ss = t[1, i, :hx], t[1, i, hx:], t[1, hy + i, :hx], t[1, hy + i, hx:]
        z_cc, z_cs, z_sc, z_ss = t[2, i, :hx], t[2, i, hx:], t[2, hy + i, :hx], t[2, hy + i, hx:]
        for j in range(hx):
            a, b, c, d = x_cc[j], x_cs[j], x_sc[j], x_ss[j]
            e, f, g, h = y_cc[j], y_cs[j], y_sc[j], y_ss[j]
            k, l, m, n = z_cc[j], z_cs[j], z_sc[j], z_ss[j]
            x_cc[j] = xx[j] * a + xy[j] * h - xz[j] * l
            x_cs[j] = xx[j] * b - xy[j] * g + xz[j] * k
            x_sc[j] = xx[j] * c - xy[j] * f - xz[j] * n
            x_ss[j] = xx[j] * d + xy[j] * e + xz[j] * m
            y_cc[j] = xy[j] * d + yy[j] * e - yz[j] * m
            y_cs[j] = -xy[j] * c + yy[j] * f - yz[j] * n
            y_sc[j] = -xy[j] * b + yy[j] * g + yz[j] * k
            y_ss[j] = xy[j] * a + yy[j] * h + yz[j] * l
            z_cc[j] = zz[j] * k + xz[j] * b + yz[j] * g
            z_cs[j] = zz[j] * l - xz[j] * a + yz[j] * h
            z_sc[j] = zz[j] * m + xz[j] * d - yz[j] * e
            z_ss[j] = zz[j] * n - xz[j] * c - yz[j] * f
