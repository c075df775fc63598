"""Which solver a contact gets: dense blocks while there are few cells, descent with answers of a rectangle beyond.

Blocks are swept where something changes, in a time and memory that go with the square of their number; a rectangle
takes what it takes. Both stand for the same operator, and tractions and displacements are their caller's, so to change
from one to the other is to make it for the same cells. To gather blocks takes as long as tens of steps: where many are
missing, descent solves in the meantime, and with every solution a portion of them is gathered.
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
_PORTION = 1.5e7
"""Multiplications of a portion that nothing waits for: 1 ms."""
_ENTRY, _LOOKUP = 300.0, 2e4
"""Multiplications that take as long as nine numbers of a contact's compliance to be gathered, and as long as a cell's
surface to be looked up."""


@dataclass
class Effort:
    """Counts of one gel: `sweeps`, solutions `unconverged`, cells `looked_up`, multiplications of solving, and the
    sweeps that the solution under way, `unsolved` so far, has taken."""

    sweeps: int = 0
    unconverged: int = 0
    looked_up: int = 0
    unsolved: int = 0
    _solving: float = 0.0

    def most(self, patch: AnyPatch) -> int:
        """Return how many sweeps a call may take."""
        return SWEEPS if patch.grows else min(SWEEPS, 1 + int(_PORTION / max(patch.work(1), 1.0)))

    def count(self, patch: AnyPatch, done: int, most: int) -> None:
        """Count a call that was done in so many sweeps, or in `most` of them was not, -1."""
        swept = done if done > 0 else most
        self.sweeps += swept
        self._solving += patch.work(swept)
        self.unsolved = 0 if done > 0 else self.unsolved + swept
        self.unconverged += SWEEPS <= self.unsolved < SWEEPS + most

    @property
    def may_go_on(self) -> bool:
        """Whether there is something left to solve, and any use in it."""
        return 0 < self.unsolved < SWEEPS

    def work(self, patch: AnyPatch) -> float:
        """Return the multiplications so far, or what takes as long: to solve, gather, and look surfaces up."""
        return self._solving + _ENTRY * patch.gathered + _LOOKUP * self.looked_up


Solver = Literal["auto", "blocks", "fft"]

MANY = 600
"""Cells beyond which descent is the faster (measured by `tests/mocks/gel/bench_spectral.py`),"""
FEW = 400
"""and below which blocks are gone back to: making them costs as much as many a step."""
_MOST_OF = 0.75
"""Descent is the faster beyond this part of all of a pad's cells, too: then its rectangle holds little else."""
AT_ONCE = 25_000
"""Entries of the compliance that are gathered at a time, nine numbers each: less than a millisecond."""


class AnyPatch:
    """A `Patch` or a `SpectralPatch`, chosen by the number of cells or by the caller."""

    def __init__(self, operator: Operator, solver: Solver = "auto") -> None:
        self._operator = operator
        self._solver = solver
        self._patch: Patch | SpectralPatch = SpectralPatch(operator) if solver == "fft" else Patch(operator)
        self._growing: Patch | None = None
        """Blocks of the first of the cells, until they are those of all."""
        self.grows = True
        """Whether blocks that are missing are gathered: not worth it for a few solutions."""
        self.gathered = 0
        """Entries of the compliance that have been gathered so far."""
        self._many = min(MANY, int(_MOST_OF * operator.grid.size))

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
        count = self.size + len(cells)
        entries = count**2 - self.size**2
        if self._solver == "auto" and isinstance(self._patch, Patch) and (count > self._many or entries > AT_ONCE):
            self._growing, self._patch = self._patch, SpectralPatch(self._operator)
            self._patch.add(np.concatenate([self._growing.cells, cells]))
            self._grow()
            return
        self.gathered += entries if isinstance(self._patch, Patch) else 0
        self._patch.add(cells)

    def keep(self, which: NDArray[np.bool_]) -> None:
        """Let all other cells go."""
        if self._growing is not None:
            self._growing.keep(which[: self._growing.size])
        self._patch.keep(which)
        if self._solver == "auto" and self.solver == "fft" and self._growing is None and self.size < FEW:
            self._growing = Patch(self._operator)
            self._grow()

    def _grow(self) -> None:
        """Gather some more blocks, and go over to them when they are complete."""
        blocks = self._growing
        if blocks is None or not self.grows:
            return
        if self.size > self._many:
            self._growing = None
            return
        known = blocks.size
        blocks.reserve(self.size)
        portion = max(1, int(math.sqrt(known**2 + AT_ONCE)) - known)
        blocks.add(self._patch.cells[known : known + portion])
        self.gathered += blocks.size**2 - known**2
        if blocks.size == self.size:
            self._patch, self._growing = blocks, None

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
        self._grow()
        return self._patch.relax(traction, w, target, friction, slid, tolerance, sweeps)

    def work(self, iterations: int) -> float:
        """Return the multiplications that so many iterations take at the most."""
        return self._patch.work(iterations)
