"""Which solver a contact gets: dense blocks while there are few cells, descent with answers of a rectangle beyond.

Blocks are swept where something changes, in a time and memory that go with the square of their number; a rectangle
takes what it takes. Both stand for the same operator, and tractions and displacements are their caller's, so to change
from one to the other is to make it for the same cells.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from lsds_mocks.gel.field.patch import Patch
from lsds_mocks.gel.field.spectral import SpectralPatch

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.operator import Operator

Solver = Literal["auto", "blocks", "fft"]

MANY = 600
"""Cells beyond which descent is the faster (measured by `tests/mocks/gel/bench_spectral.py`),"""
FEW = 400
"""and below which blocks are gone back to: making them costs as much as many a step."""


class AnyPatch:
    """A `Patch` or a `SpectralPatch`, whichever suits the number of cells, or the one asked for."""

    def __init__(self, operator: Operator, solver: Solver = "auto") -> None:
        self._operator = operator
        self._solver = solver
        self._patch: Patch | SpectralPatch = SpectralPatch(operator) if solver == "fft" else Patch(operator)

    @property
    def cells(self) -> NDArray[np.int32]:
        """Numbers of the cells."""
        return self._patch.cells

    @property
    def size(self) -> int:
        """Number of cells."""
        return self._patch.size

    @property
    def solver(self) -> Literal["blocks", "fft"]:
        """The one in use."""
        return "fft" if isinstance(self._patch, SpectralPatch) else "blocks"

    def add(self, cells: NDArray[np.int32]) -> None:
        """Take cells in that are not in yet."""
        many = self._solver == "auto" and self.solver == "blocks" and self.size + len(cells) > MANY
        if many:
            known, self._patch = self._patch.cells, SpectralPatch(self._operator)
            self._patch.add(known)
        self._patch.add(cells)

    def keep(self, which: NDArray[np.bool_]) -> None:
        """Let all other cells go."""
        if self._solver == "auto" and self.solver == "fft" and int(which.sum()) < FEW:
            kept, self._patch = self._patch.cells[which], Patch(self._operator)
            self._patch.add(kept)
        else:
            self._patch.keep(which)

    def respond(self, traction: NDArray[np.float32], w: NDArray[np.float32], known: int = 0) -> None:
        """Write the displacement of the cells from `known` on under `traction`."""
        self._patch.respond(traction, w, known)

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
        """Solve for `traction` and `w`; return the iterations, or -1 where `sweeps` were not enough."""
        return self._patch.relax(traction, w, target, friction, slid, tolerance, sweeps)

    def work(self, iterations: int) -> float:
        """Return the multiplications that so many iterations take at the most."""
        return self._patch.work(iterations)
