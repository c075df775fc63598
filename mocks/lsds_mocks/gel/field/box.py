"""Elastic response over a rectangle of cells: equals the dense compliance, computed by products of small matrices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.gel.field.walls import Walls, walls, whole
from lsds_mocks.gel.field.waves import multiply, waves

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.operator import Operator

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
        by_walls = float((self._walls.sizes**2).sum()) if self._walls is not None else 0.0
        return (1 if self._is_whole else 2) * through + by_walls

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
