"""What solving a contact has taken, and how much of it a call may take."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds_mocks.gel.field.choice import AnyPatch

SWEEPS = 200
_PORTION = 1.5e7
"""Multiplications of a portion, where nobody waits: 1 ms."""
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
