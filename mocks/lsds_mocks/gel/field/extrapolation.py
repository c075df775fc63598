"""First guess of a contact's solution: linear in the motion, through two solutions before.

While nothing begins or ends to slide, tractions are linear in the object's motion. A vibration of a tenth of a
micrometre, or a slow lift, then needs no iteration at all: the solver only checks the guess. Traction and displacement
are extrapolated together, so they stay consistent.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Solution = tuple[tuple[float, ...], NDArray[np.float32], NDArray[np.float32]]

MOST_WAYS = 3.0
"""Largest extrapolation, in ways from the older to the newer solution; chosen."""
APART = 0.2
"""Share of that distance within which a newer solution replaces the newer one only; chosen. Both have errors up to the
tolerance, so the closer they lie, the less certain is their slope."""


class Extrapolation:
    """The last two solutions (motion, traction (3, n), displacement (3, n)) that took iterations."""

    def __init__(self) -> None:
        self._newer: Solution | None = None
        self._older: Solution | None = None

    def clear(self) -> None:
        """Forget both: cells or anchors have changed."""
        self._newer = self._older = None

    def learn(self, at: tuple[float, ...], traction: NDArray[np.float32], w: NDArray[np.float32]) -> None:
        """Take a solution at a motion `at` since the increment began, each of its components in metres."""
        newer, older = self._newer, self._older
        near = newer and older and math.dist(at, newer[0]) < APART * math.dist(newer[0], older[0])
        spare = newer if near else older
        if not near:
            self._older = newer
        if spare is None:
            self._newer = at, traction.copy(), w.copy()
            return
        np.copyto(spare[1], traction)
        np.copyto(spare[2], w)
        self._newer = at, spare[1], spare[2]

    def guess(self, at: tuple[float, ...], traction: NDArray[np.float32], w: NDArray[np.float32]) -> None:
        """Write the guess at a motion; change nothing before two solutions are known."""
        newer, older = self._newer, self._older
        if newer is None or older is None:
            return
        way = [new - old for new, old in zip(newer[0], older[0], strict=True)]
        size = sum(part * part for part in way)
        if size == 0.0:
            return
        along = sum((now - new) * part for now, new, part in zip(at, newer[0], way, strict=True))
        share = min(max(along / size, -MOST_WAYS), MOST_WAYS)
        _extrapolate(newer[1], older[1], np.float32(share), traction)
        _extrapolate(newer[2], older[2], np.float32(share), w)


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def _extrapolate(
    newer: NDArray[np.float32], older: NDArray[np.float32], share: np.float32, out: NDArray[np.float32]
) -> None:
    for a in range(out.shape[0]):
        for i in range(out.shape[1]):
            out[a, i] = newer[a, i] + share * (newer[a, i] - older[a, i])
