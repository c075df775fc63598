"""Elastic responses by classes of points that do not couple, in as few numbers as possible.

**The walls**, the pad's correction, act on hats (`lsds_mocks.gel.field.correction`). Reading the dense correction of
all hats costs more than the rest of a large rectangle. Along each axis one of two reductions applies: only the hats
over the rectangle or, for a long rectangle, sums and differences of mirror-image hats, which do not couple.

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

_Stretch = tuple[int, int] | None
"""First hat and the one after the last, or all of them, by mirror images."""


@dataclass(frozen=True, eq=False)
class Walls:
    """The pad's correction over a rectangle, in classes of hats that do not couple; or the whole response of a pad, in
    which cells take the place of hats.

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
