"""Elastic response over a rectangle of cells: equals the dense compliance, computed by products of small matrices.

**The layer** acts on sines and cosines: its table becomes one number, or a few, per wave. Cells outside the rectangle
carry no traction, so a table with a period of 2 n - 1 cells acts on n of them like the whole one; if the layer's own
period is shorter, that is used. Along one axis, an even table maps cosine to cosine and sine to sine; an odd table maps
cosine to sine and sine to minus cosine. All numbers are therefore real, and the transform is a product with a small
matrix on each side. At these sizes, and without rounding up to a fast length, that costs no more than a fast Fourier
transform, and a third of it on small rectangles.

**The walls**, the pad's correction, are stored in as few numbers as possible, because reading the dense correction of
all hats costs more than the rest of a large rectangle. Along each axis one of two reductions applies: only the hats
over the rectangle or, for a long rectangle, sums and differences of mirror-image hats, which do not couple (see
`lsds_mocks.gel.field.correction`).

**A whole pad of few cells** has about as many hats as cells. Sums and differences of mirror-image cells then carry
layer and walls at once, in less than two thirds of the time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from lsds_mocks.byte_cache import kept
from lsds_mocks.gel.field.dense import Patch

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


_Stretch = tuple[int, int] | None
"""First hat and the one after the last, or all of them, by mirror images."""


@dataclass(frozen=True, eq=False)
class Walls:
    """The pad's correction over a rectangle, in classes of hats that do not couple.

    `down` (rows, n) and `across` (columns, m) hold the mean over each cell of each hat, or of each sum or difference of
    mirror images. `order` (3 n m,) sorts their values (3, n, m) into consecutive classes of `sizes` (classes,).
    `matrix` holds the upper half of each class's symmetric matrix (size, size), row by row, in metres per pascal; the
    upper halves fit into a processor's cache, full matrices would not.
    """

    down: NDArray[np.float32]
    across: NDArray[np.float32]
    order: NDArray[np.int64]
    sizes: NDArray[np.int64]
    matrix: NDArray[np.float32]

    def answer(self, hats: NDArray[np.float32]) -> None:
        """Replace the tractions on the hats (3 n m,) by the displacements that they cause."""
        _symmetric(self.order, self.sizes, self.matrix, hats)


@kept
def walls(operator: Operator, row: int, column: int, rows: int, columns: int) -> Walls:
    """Return the correction for `rows` x `columns` cells from cell (row, column) on."""
    grid = operator.grid
    down = hats_over(grid.rows, grid.fine)[row : row + rows]
    across = hats_over(grid.columns, grid.fine)[column : column + columns]
    high, wide = _stretch(down), _stretch(across)
    return Walls(
        np.ascontiguousarray(down @ _mirrored(down.shape[1]) if high is None else down[:, slice(*high)]),
        np.ascontiguousarray(across @ _mirrored(across.shape[1]) if wide is None else across[:, slice(*wide)]),
        *_classes(operator, high, wide),
    )


def _stretch(over: NDArray[np.float32]) -> _Stretch:
    """Return which hats to use, given their means (cells, hats) over a rectangle."""
    under = np.flatnonzero(over.any(axis=0))
    return None if 2 * len(under) ** 2 > over.shape[1] ** 2 else (int(under[0]), int(under[-1]) + 1)


@kept
def _classes(
    operator: Operator, high: _Stretch, wide: _Stretch
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]:
    """Return order, sizes and matrices of the classes for the hats of two stretches."""
    hats = operator.grid.hats
    taken = np.zeros((3, hats.rows + 1, hats.columns + 1), bool)
    taken[:, slice(*(high or (None,))), slice(*(wide or (None,)))] = True
    number = np.cumsum(taken) - 1
    order, classes = [], []
    for members, matrix in _folded_hats(operator, high is None, wide is None):
        kept = taken.ravel()[members]
        order.append(number[members[kept]])
        classes.append(matrix[np.ix_(kept, kept)])
    return _packed(order, classes)


@kept
def whole(operator: Operator) -> Walls:
    """Return the response of all cells of a pad, layer and walls together, in classes of mirror-image cells."""
    grid = operator.grid
    patch = Patch(operator)
    patch.add(np.arange(grid.size, dtype=np.int32))
    matrix = patch.compliance.transpose(1, 0, 2, 3).reshape(3 * grid.size, 3 * grid.size)
    classes = _folded(matrix, (grid.rows, grid.columns), True, True)
    return Walls(
        _mirrored(grid.rows),
        _mirrored(grid.columns),
        *_packed([members for members, _ in classes], [part for _, part in classes]),
    )


def _packed(
    order: list[NDArray[np.int64]], classes: list[NDArray[np.float32]]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]:
    """Return order, sizes and upper halves of classes."""
    halves = [part[np.triu_indices(len(part))] for part in classes]
    return np.concatenate(order), np.array([len(part) for part in classes]), np.concatenate(halves)


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def _symmetric(
    order: NDArray[np.int64], sizes: NDArray[np.int64], matrix: NDArray[np.float32], hats: NDArray[np.float32]
) -> None:
    """Multiply `hats` in place, in this order and in parts of these sizes, by symmetric matrices (upper halves)."""
    load, lift = hats[order], np.zeros(order.size, np.float32)
    begin, at = 0, 0
    for size in sizes:
        x, y = load[begin : begin + size], lift[begin : begin + size]
        begin += size
        i = 0
        # Four rows at a time, so that factors and sums are read and written a quarter as often.
        while i + 3 < size:
            n = size - i
            a, b = matrix[at : at + n], matrix[at + n : at + 2 * n - 1]
            c, d = matrix[at + 2 * n - 1 : at + 3 * n - 3], matrix[at + 3 * n - 3 : at + 4 * n - 6]
            at += 4 * n - 6
            p, q, r, s = x[i], x[i + 1], x[i + 2], x[i + 3]
            first = a[0] * p + a[1] * q + a[2] * r + a[3] * s
            second = a[1] * p + b[0] * q + b[1] * r + b[2] * s
            third = a[2] * p + b[1] * q + c[0] * r + c[1] * s
            fourth = a[3] * p + b[2] * q + c[1] * r + d[0] * s
            a_on, b_on, c_on, d_on = a[4:], b[3:], c[2:], d[1:]
            x_on, y_on = x[i + 4 :], y[i + 4 :]
            for j in range(n - 4):
                z = x_on[j]
                first += a_on[j] * z
                second += b_on[j] * z
                third += c_on[j] * z
                fourth += d_on[j] * z
                y_on[j] += a_on[j] * p + b_on[j] * q + c_on[j] * r + d_on[j] * s
            y[i] += first
            y[i + 1] += second
            y[i + 2] += third
            y[i + 3] += fourth
            i += 4
        while i < size:
            row = matrix[at : at + size - i]
            at += size - i
            y[i] += row[0] * x[i]
            for j in range(1, size - i):
                y[i] += row[j] * x[i + j]
                y[i + j] += row[j] * x[i]
            i += 1
    for k in range(order.size):
        hats[order[k]] = lift[k]


@kept
def _folded_hats(operator: Operator, fold_y: bool, fold_x: bool) -> list[tuple[NDArray[np.int64], NDArray[np.float32]]]:
    """Return the whole correction in classes."""
    shape = operator.grid.hats.rows + 1, operator.grid.hats.columns + 1
    size = 3 * shape[0] * shape[1]
    return _folded(operator.correction.reshape(size, size), shape, fold_y, fold_x)


def _folded(
    matrix: NDArray[np.float32], shape: tuple[int, int], fold_y: bool, fold_x: bool
) -> list[tuple[NDArray[np.int64], NDArray[np.float32]]]:
    """Return a matrix over (3, points along y, along x) in classes: numbers (size,) of points, matrix (size, size)."""
    high, wide = shape
    size = len(matrix)
    if not (fold_y or fold_x):
        return [(np.arange(size), matrix)]
    for _ in range(2):  # the matrix is symmetric: fold its rows, then its former columns
        if fold_y:
            matrix = _fold(matrix.reshape(3, high, wide * size))
        if fold_x:
            matrix = _fold(matrix.reshape(3 * high, wide, size))
        matrix = np.ascontiguousarray(matrix.reshape(size, size).T)
    number = np.arange(size).reshape(3, high, wide)
    classes = []
    for flip_y, flip_x in product((False, True)[: 1 + fold_y], (False, True)[: 1 + fold_x]):
        # A reflection keeps depth and reverses motion across the mirror.
        parts = [
            number[d][
                _half(high, flip_y != (d == 1)) if fold_y else slice(None),
                _half(wide, flip_x != (d == 0)) if fold_x else slice(None),
            ]
            for d in range(3)
        ]
        members = np.concatenate([part.ravel() for part in parts])
        classes.append((members, matrix[np.ix_(members, members)]))
    return classes


def _fold(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return values (m, size, n) as sums and differences of mirror images: `_mirrored(size).T @ values`, but faster."""
    pairs, middle = values.shape[1] // 2, values.shape[1] % 2
    first, last = values[:, :pairs], values[:, : -pairs - 1 : -1]
    part = np.float32(math.sqrt(0.5))
    return np.concatenate([part * (first + last), values[:, pairs : pairs + middle], part * (first - last)], axis=1)


def _half(size: int, odd: bool) -> slice:
    return slice((size + 1) // 2, None) if odd else slice((size + 1) // 2)


def _mirrored(size: int) -> NDArray[np.float32]:
    """Return (size, size), orthonormal: sums of mirror images, from the ends to the middle, then differences."""
    half = np.eye(size)[:, : (size + 1) // 2]
    both = np.concatenate([half + half[::-1], (half - half[::-1])[:, : size // 2]], axis=1)
    return np.asarray(both / np.linalg.norm(both, axis=0), np.float32)


@lru_cache(maxsize=16)
def hats_over(cells: int, fine: int) -> NDArray[np.float32]:
    """Return (cells, hats): the mean of each hat over each cell, along one axis."""
    place = (np.arange(cells) + 0.5) / fine
    return np.asarray(np.maximum(1 - np.abs(place[:, None] - np.arange(cells // fine + 1)), 0), np.float32)


MOST_WHOLE_CELLS = 600
"""Number of cells of a pad up to which the response of all of them is one operation; chosen above the 546 of the
default pad's coarsest grid."""


class Box:
    """`rows` x `columns` cells from cell (row, column) on. Fields are (3, rows, columns), single precision and
    contiguous: x, y, and pressure or depth."""

    def __init__(self, operator: Operator, row: int, column: int, rows: int, columns: int) -> None:
        self.row, self.column, self.rows, self.columns = row, column, rows, columns
        self._waves = waves(operator, rows, columns)
        self._is_whole = operator.grid.size <= MOST_WHOLE_CELLS and rows * columns == operator.grid.size
        self._walls = None
        if self._is_whole:
            self._walls = whole(operator)
        elif operator.correction.size:
            self._walls = walls(operator, row, column, rows, columns)
        high, wide = len(self._waves.down), len(self._waves.across)
        self._half = np.empty((3, high, columns), np.float32)
        self._full = np.empty((3, high, wide), np.float32)
        if self._walls is not None:
            hats_y, hats_x = self._walls.down.shape[1], self._walls.across.shape[1]
            self._bent = np.empty((3, rows, columns), np.float32)
            self._strips = np.empty((3, rows, hats_x), np.float32)
            self._hats = np.empty((3, hats_y, hats_x), np.float32)

    def covers(self, rows: NDArray[np.int32], columns: NDArray[np.int32]) -> bool:
        """Return whether all these cells lie in the rectangle."""
        return bool(
            rows.min() >= self.row
            and columns.min() >= self.column
            and rows.max() < self.row + self.rows
            and columns.max() < self.column + self.columns
        )

    @property
    def work(self) -> float:
        """Multiplications of one `respond` and one `precondition`."""
        high, wide = self._full.shape[1:]
        through = 2.0 * 3 * high * (self.rows * self.columns + self.columns * wide)
        return 2 * through + (float((self._walls.sizes**2).sum()) if self._walls is not None else 0.0)

    def respond(self, traction: NDArray[np.float32], out: NDArray[np.float32], first: int = 0) -> None:
        """Write the displacement (m) of all cells under a traction (Pa); only its components from `first` on."""
        if not self._is_whole:
            self._through_waves(self._waves.symbol, traction, out, first)
        if self._walls is not None:
            self._through_walls(self._walls, traction, out, first)

    def precondition(self, displacement: NDArray[np.float32], out: NDArray[np.float32]) -> None:
        """Write the approximate traction (Pa) that causes a displacement (m).

        The operation is symmetric and positive, and accurate for waves that are short compared with the rectangle.
        """
        self._through_waves(self._waves.inverse, displacement, out, 0)

    def _through_waves(
        self, symbol: NDArray[np.float32], field: NDArray[np.float32], out: NDArray[np.float32], first: int
    ) -> None:
        down, across = self._waves.down, self._waves.across
        wide, columns = len(across), self.columns
        np.matmul(down, field, out=self._half)
        np.matmul(self._half.reshape(-1, columns), across.T, out=self._full.reshape(-1, wide))
        multiply(symbol, self._full)
        half = self._half[first:]
        np.matmul(self._full[first:].reshape(-1, wide), across, out=half.reshape(-1, columns))
        np.matmul(down.T, half, out=out)

    def _through_walls(self, walls: Walls, traction: NDArray[np.float32], out: NDArray[np.float32], first: int) -> None:
        np.matmul(traction, walls.across, out=self._strips)
        np.matmul(walls.down.T, self._strips, out=self._hats)
        walls.answer(self._hats.reshape(-1))
        strips, bent = self._strips[first:], out if self._is_whole else self._bent[first:]
        np.matmul(walls.down, self._hats[first:], out=strips)
        np.matmul(strips, walls.across.T, out=bent)
        if bent is not out:
            out += bent
