"""Upper bound on the error of a grid, from the contact's width in cells alone.

In 90 random simulated scenes (spheres, cylinders, edges, blocks; cells of 0.96 mm against cells of half the size) the
error over a scene, as part of the markers' motion, was at most nine tenths of the bound. For narrow contacts it reached
0.38, so they have no bound.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.grid import CellGrid

NARROW = 2.5
"""Contacts with fewer cells across are always audited on finer grids."""
_SHARES = ((NARROW, math.inf), (3.5, 0.12), (5.0, 0.075), (np.inf, 0.06))
"""Contact width (cells) and the bound, as part of the markers' motion, for contacts narrower than that."""
_SHARP_SHARE = 0.21
"""Least bound for a face with a sharp edge, as part of the markers' motion."""
_SHARP = 1.7
"""Ratio of greatest to mean pressure above which a face has a sharp edge; a sphere has 1.5."""


def share_of_motion(grid: CellGrid, cells: NDArray[np.int32], pressure: NDArray[np.floating]) -> float:
    """Return the bound for a contact of cells (N,) under pressure (N,)."""
    touching = pressure > 0
    bound = next(share for width, share in _SHARES if across(grid, cells[touching]) < width)
    return max(bound, _SHARP_SHARE) if is_sharp(pressure) else bound


def is_sharp(pressure: NDArray[np.floating]) -> bool:
    """Return whether the pressure (N,) shows that a face has a sharp edge."""
    under = pressure[pressure > 0]
    return under.size > 0 and float(under.max()) > _SHARP * float(under.mean())


def across(grid: CellGrid, cells: NDArray[np.int32]) -> float:
    """Return the width of a patch in cells: four areas over the perimeter."""
    covered = np.zeros((grid.rows + 2, grid.columns + 2), np.bool_)
    covered[cells // grid.columns + 1, cells % grid.columns + 1] = True
    perimeter = np.count_nonzero(covered[1:] != covered[:-1]) + np.count_nonzero(covered[:, 1:] != covered[:, :-1])
    return 4 * len(cells) / perimeter if perimeter else 0.0


class OverTheWay:
    """RMS over an object's travel of a quantity that changes linearly between its samples."""

    def __init__(self) -> None:
        self._at_m = self._value = self._square = 0.0

    def add(self, at_m: float, value: float) -> float:
        """Add the sample `value` at travel `at_m`; return the RMS up to there."""
        before, self._value = self._value, value
        self._square += (at_m - self._at_m) * (before * before + before * value + value * value) / 3
        self._at_m = at_m
        return math.sqrt(self._square / at_m) if at_m > 0 else value
