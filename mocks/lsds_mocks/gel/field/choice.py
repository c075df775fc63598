"""Choice of the contact solver: dense blocks for few cells, descent on a rectangle for many.

The block solver sweeps only where something changes, but its time and memory grow with the square of the cell count;
the cost of a rectangle is fixed. Both represent the same operator, and the caller holds tractions and displacements, so
either can replace the other at any time. Gathering all blocks takes as long as tens of steps. If many are missing,
descent solves meanwhile, and each solution gathers a portion of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from lsds_mocks.gel.field.dense import Patch
from lsds_mocks.gel.field.spectral import SpectralPatch

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.operator import Operator


SWEEPS = 200
"""Maximum number of sweeps of a solution before it counts as not converged; chosen."""
_PORTION = 1.5e7
"""Multiplications of one portion of background work: 1 ms."""
_ENTRY_COST = 300.0
"""Cost, in multiplications, of gathering one entry of a contact's compliance (nine numbers)."""
_LOOKUP = 2e4
"""Cost, in multiplications, of looking up the object's surface over one cell."""


@dataclass
class Effort:
    """Work of one gel: `sweeps`, `unconverged` solutions, cells `looked_up`, and multiplications of solving.

    `unsolved` is the number of sweeps of a solution in progress, 0 without one.
    """

    sweeps: int = 0
    unconverged: int = 0
    looked_up: int = 0
    unsolved: int = 0
    _solving: float = 0.0

    def most(self, patch: AnyPatch) -> int:
        """Return the maximum number of sweeps of a call."""
        return SWEEPS if patch.grows else min(SWEEPS, 1 + int(_PORTION / max(patch.work(1), 1.0)))

    def count(self, patch: AnyPatch, done: int, most: int) -> None:
        """Count a call that converged in `done` sweeps, or (-1) did not converge in `most`."""
        swept = max(done, 1) if done >= 0 else most
        self.sweeps += swept
        self._solving += patch.work(swept)
        self.unsolved = 0 if done >= 0 else self.unsolved + swept
        self.unconverged += SWEEPS <= self.unsolved < SWEEPS + most

    @property
    def may_go_on(self) -> bool:
        """Whether the solution is incomplete and its sweeps are not used up."""
        return 0 < self.unsolved < SWEEPS

    def work(self, patch: AnyPatch) -> float:
        """Return the work so far in multiplications: solving, gathering, and looking surfaces up."""
        return self._solving + _ENTRY_COST * patch.gathered + _LOOKUP * self.looked_up


Solver = Literal["auto", "blocks", "fft"]

MANY_CELLS = 600
"""Number of cells above which descent is faster (measured by `tests/mocks/gel/bench_spectral.py`)."""
FEW_CELLS = 400
"""Number of cells below which blocks replace descent again; less than `MANY_CELLS`, because blocks are expensive."""
_MOST_OF = 0.75
"""Part of a pad's cells above which descent is faster, too, because its rectangle then contains few other cells."""
ENTRIES_AT_ONCE = 25_000
"""Entries of the compliance gathered at a time, nine numbers each: less than a millisecond."""


class AnyPatch:
    """A `Patch` or a `SpectralPatch`, chosen by the number of cells or by the caller."""

    def __init__(self, operator: Operator, solver: Solver = "auto") -> None:
        self._operator = operator
        self._solver = solver
        self._patch: Patch | SpectralPatch = SpectralPatch(operator) if solver == "fft" else Patch(operator)
        self._growing: Patch | None = None
        """Blocks of the first cells; they grow until they cover all cells."""
        self.grows = True
        """Whether missing blocks are gathered; a few solutions do not justify the cost."""
        self.gathered = 0
        """Entries of the compliance that have been gathered so far."""
        self._many = min(MANY_CELLS, int(_MOST_OF * operator.grid.size))

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
        """Add cells that are not included yet."""
        count = self.size + len(cells)
        entries = count**2 - self.size**2
        if (
            self._solver == "auto"
            and isinstance(self._patch, Patch)
            and (count > self._many or entries > ENTRIES_AT_ONCE)
        ):
            self._growing, self._patch = self._patch, SpectralPatch(self._operator)
            self._patch.add(np.concatenate([self._growing.cells, cells]))
            self._grow()
            return
        self.gathered += entries if isinstance(self._patch, Patch) else 0
        self._patch.add(cells)

    def keep(self, which: NDArray[np.bool_]) -> None:
        """Remove all other cells."""
        if self._growing is not None:
            self._growing.keep(which[: self._growing.size])
        self._patch.keep(which)
        if self._solver == "auto" and self.solver == "fft" and self._growing is None and self.size < FEW_CELLS:
            self._growing = Patch(self._operator)
            self._grow()

    def _grow(self) -> None:
        """Gather a portion of the missing blocks; switch to the block solver once they are complete."""
        blocks = self._growing
        if blocks is None or not self.grows:
            return
        if self.size > self._many:
            self._growing = None
            return
        known = blocks.size
        blocks.reserve(self.size)
        portion = max(1, int(math.sqrt(known**2 + ENTRIES_AT_ONCE)) - known)
        blocks.add(self._patch.cells[known : known + portion])
        self.gathered += blocks.size**2 - known**2
        if blocks.size == self.size:
            self._patch, self._growing = blocks, None

    def respond(self, traction: NDArray[np.float32], w: NDArray[np.float32], known: int = 0) -> None:
        """Write the displacement of the cells from number `known` on under `traction`."""
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
        """Solve for `traction` and `w`; return the iterations, 0 if descent found that the present values are the
        solution, or -1 if `sweeps` were not enough."""
        self._grow()
        return self._patch.relax(traction, w, target, friction, slid, tolerance, sweeps)

    def work(self, iterations: int) -> float:
        """Return the maximum number of multiplications of `iterations` iterations."""
        return self._patch.work(iterations)
