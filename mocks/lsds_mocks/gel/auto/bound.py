"""How large the error of a grid can be, before anything is known of it but how many cells the contact is wide.

Errors over whole scenes, as part of the dots' motion, were nine tenths of these at the most in 90 random ones (spheres,
cylinders, edges, blocks, on cells of 0.96 mm against cells of half the size; simulated). Of narrow contacts they were
up to 0.38, and nothing is promised.
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
"""Below a width in cells."""
_SHARP_SHARE = 0.21
_SHARP = 1.7
"""A face with an edge: its greatest pressure is over so many times the mean. Of a sphere's it is 1.5 times."""


def share_of_motion(grid: CellGrid, cells: NDArray[np.int32], pressure: NDArray[np.floating]) -> float:
    """Return the bound for a contact of cells (N,) under pressure (N,)."""
    touching = pressure > 0
    bound = next(share for width, share in _SHARES if across(grid, cells[touching]) < width)
    return max(bound, _SHARP_SHARE) if is_sharp(pressure) else bound


def is_sharp(pressure: NDArray[np.floating]) -> bool:
    """Return from its pressure (N,) whether a face has an edge."""
    under = pressure[pressure > 0]
    return under.size > 0 and float(under.max()) > _SHARP * float(under.mean())


def across(grid: CellGrid, cells: NDArray[np.int32]) -> float:
    """Return how many cells a patch is wide: four areas over the perimeter."""
    covered = np.zeros((grid.rows + 2, grid.columns + 2), np.bool_)
    covered[cells // grid.columns + 1, cells % grid.columns + 1] = True
    perimeter = np.count_nonzero(covered[1:] != covered[:-1]) + np.count_nonzero(covered[:, 1:] != covered[:, :-1])
    return 4 * len(cells) / perimeter if perimeter else 0.0


class OverTheWay:
    """RMS, over the way an object has gone, of something that changes evenly between the places it is looked at."""

    def __init__(self) -> None:
        self._at_m = self._value = self._square = 0.0

    def add(self, at_m: float, value: float) -> float:
        """Return the RMS up to `at_m`, where it is `value`."""
        before, self._value = self._value, value
        self._square += (at_m - self._at_m) * (before * before + before * value + value * value) / 3
        self._at_m = at_m
        return math.sqrt(self._square / at_m) if at_m > 0 else value
