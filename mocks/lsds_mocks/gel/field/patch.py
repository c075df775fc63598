"""The cells that touch or nearly touch, with their dense compliance; cells come and go as the contact moves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.gel.field.blocks import correct, gather, mirror
from lsds_mocks.gel.field.sweep import own, relax, respond

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.operator import Operator

_STEP = 64


class Patch:
    """Numbered cells of a grid, their tractions (3, n) in pascal (on the gel: x, y, pressure) and their mean
    displacement (3, n) in metres (x, y, into the gel)."""

    def __init__(self, operator: Operator) -> None:
        self.operator = operator
        self.cells = np.zeros(0, np.int32)
        self._rows = np.zeros(0, np.int32)
        self._columns = np.zeros(0, np.int32)
        self._compliance = np.zeros((_STEP, 3, 3, _STEP), np.float32)
        self._diagonal = np.zeros((_STEP, 4), np.float32)

    @property
    def size(self) -> int:
        """Number of cells."""
        return len(self.cells)

    def reserve(self, count: int) -> None:
        """Make room for so many cells, and some more, keeping what is there."""
        if count <= len(self._diagonal):
            return
        n, room = self.size, -(-count * 5 // 4 // _STEP) * _STEP
        compliance = np.zeros((room, 3, 3, room), np.float32)
        diagonal = np.zeros((room, 4), np.float32)
        if n:
            compliance[:n, :, :, :n] = self._compliance[:n, :, :, :n]
            diagonal[:n] = self._diagonal[:n]
        self._compliance, self._diagonal = compliance, diagonal

    def add(self, cells: NDArray[np.int32]) -> None:
        """Take cells in that are not in yet."""
        known = self.size
        count = known + len(cells)
        self.reserve(count)
        columns = self.operator.grid.columns
        self.cells = np.concatenate([self.cells, cells]).astype(np.int32)
        self._rows, self._columns = self.cells // columns, self.cells % columns
        place = (self._compliance, self._rows, self._columns, known, count)
        gather(*place, self.operator.cells)
        if self.operator.correction.size:
            grid = self.operator.grid
            correct(*place, self.operator.correction, grid.fine, grid.hats.rows, grid.hats.columns)
        mirror(self._compliance, known, count)
        own(self._compliance, self._diagonal, known, count)

    def keep(self, which: NDArray[np.bool_]) -> None:
        """Let all other cells go."""
        kept = np.flatnonzero(which)
        self._compliance[: len(kept), :, :, : len(kept)] = self._compliance[kept][..., kept]
        self._diagonal[: len(kept)] = self._diagonal[kept]
        self.cells = self.cells[kept]
        self._rows, self._columns = self._rows[kept], self._columns[kept]

    def respond(self, traction: NDArray[np.float32], w: NDArray[np.float32], known: int = 0) -> None:
        """Write the displacement of the cells from `known` on under `traction`."""
        respond(self._compliance, traction, w, known, self.size)

    def depths(self) -> NDArray[np.float32]:
        """Return (n, 3, n): what traction (x, y, pressure) in a cell does to the depth of all, metres per pascal."""
        return np.ascontiguousarray(self._compliance[: self.size, :, 2, : self.size])

    def relax(
        self,
        traction: NDArray[np.float32],
        w: NDArray[np.float32],
        target: NDArray[np.float32],
        friction: NDArray[np.float32],
        slid: NDArray[np.bool_],
        tolerance: float,
        sweeps: int,
    ) -> int:
        """Solve for `traction` and `w`, see `lsds_mocks.gel.field.sweep`."""
        return int(
            relax(self._compliance, self._diagonal, traction, w, target, friction, slid, self.size, tolerance, sweeps)
        )

    def work(self, sweeps: int) -> float:
        """Return the multiplications that so many sweeps take at the most."""
        return 9.0 * sweeps * self.size**2
