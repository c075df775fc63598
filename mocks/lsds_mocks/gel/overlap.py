"""Overlap of an object with a flat gel at any indentation, by counts on a lattice of the object's gap."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Overlap:
    """Counts points of a lattice whose gap (m) is less than an indentation, and edges between neighbours.

    `gap_m` is (rows, columns); `columns_m` and `rows_m` are the least gaps of each column and row. The gaps are sorted
    once, because a grip asks at each step of the simulation.
    """

    def __init__(self, gap_m: NDArray[np.float64]) -> None:
        self.columns_m, self.rows_m = gap_m.min(axis=0), gap_m.min(axis=1)
        self._gaps = np.sort(gap_m, axis=None)
        self._sums = np.concatenate([[0.0], np.cumsum(self._gaps)])
        neighbours = (gap_m[1:], gap_m[:-1]), (gap_m[:, 1:], gap_m[:, :-1])
        self._nearer = np.sort(np.concatenate([np.minimum(*pair).ravel() for pair in neighbours]))
        self._farther = np.sort(np.concatenate([np.maximum(*pair).ravel() for pair in neighbours]))

    def points(self, indentation_m: float) -> int:
        """Return the number of points under the object."""
        return int(np.searchsorted(self._gaps, indentation_m))

    def depth_m(self, indentation_m: float) -> float:
        """Return the sum, over those points, of the indentation less the gap (m)."""
        points = self.points(indentation_m)
        return points * indentation_m - float(self._sums[points])

    def edges(self, indentation_m: float) -> int:
        """Return the number of pairs of neighbours of which one is under the object and the other is not."""
        return int(np.searchsorted(self._nearer, indentation_m) - np.searchsorted(self._farther, indentation_m))
