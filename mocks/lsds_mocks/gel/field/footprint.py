"""Gap and slope of an object over the cells, as means over each cell, at any placement of the object."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.grid import CellGrid
    from lsds_mocks.gel.placement import Placement
    from lsds_mocks.gel.shapes import Shape

_SURFACE_SAMPLES = 8
"""Samples of the object's surface per hat interval: 0.12 mm apart."""


def own_coordinates(
    place: Placement, x_m: NDArray[np.float64], y_m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return points of the pad in the coordinates of an object at `place`."""
    x, y = x_m - place.x_m, y_m - place.y_m
    if place.angle_rad:
        cos, sin = math.cos(place.angle_rad), math.sin(place.angle_rad)
        x, y = cos * x + sin * y, cos * y - sin * x
    return x, y


class Footprint:
    """Cell means of gap (n,) and slope of the gap along x and y (2, n), for one shape on one grid.

    The surface is sampled on a lattice over all the cells, so that neighbours share the samples on their edges, unless
    most of it would lie outside them.
    """

    def __init__(self, shape: Shape, grid: CellGrid) -> None:
        self.shape = shape
        self._grid = grid
        self._steps = max(1, _SURFACE_SAMPLES // grid.fine)
        self._x_m = _lattice(grid.columns, self._steps, grid.material.width_m)
        self._y_m = _lattice(grid.rows, self._steps, grid.material.height_m)

    def over(self, cells: NDArray[np.int32], place: Placement) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return gap and slope over numbered cells. The slope's mean is exact: the gap's rise from edge to edge."""
        if not len(cells):
            return np.zeros(0), np.zeros((2, 0))
        steps, grid = self._steps, self._grid
        at = cells.astype(np.int64)
        top, left = steps * (at // grid.columns), steps * (at % grid.columns)
        rows, columns = top.max() - top.min() + steps + 1, left.max() - left.min() + steps + 1
        if rows * columns <= len(cells) * (steps + 1) ** 2:
            x_m = self._x_m[None, left.min() : left.max() + steps + 1]
            y_m = self._y_m[top.min() : top.max() + steps + 1, None]
            top, left = top - top.min(), left - left.min()
        else:
            # Cells in a slanted line: most of the lattice would lie outside them. Each has its own samples.
            along = np.arange(steps + 1)
            x_m = np.repeat(self._x_m[left[:, None] + along], steps + 1, axis=0)
            y_m = self._y_m[top[:, None] + along].reshape(-1, 1)
            top, left = np.arange(len(cells)) * (steps + 1), np.zeros(len(cells), np.int64)
        gap = np.broadcast_to(self.shape.gap(*own_coordinates(place, x_m, y_m)), (y_m.shape[0], x_m.shape[1]))
        mean, slope = np.empty(len(cells)), np.empty((2, len(cells)))
        _average(gap, top, left, steps, grid.dx_m, grid.dy_m, mean, slope)
        return mean, slope

    def near(self, place: Placement, reach_m: float) -> NDArray[np.bool_]:
        """Return (cells,): whether the gap without texture at the cell's centre is below `reach_m`."""
        at = own_coordinates(place, self._grid.x_m[None, :], self._grid.y_m[:, None])
        gap = np.broadcast_to(self.shape.least_gap(*at), (self._grid.rows, self._grid.columns))
        return np.asarray(gap < reach_m).ravel()


def _lattice(cells: int, steps: int, size_m: float) -> NDArray[np.float64]:
    """Return the positions (m) of the samples along one axis of a pad, `steps` for each cell and one at the end."""
    return np.asarray((np.arange(cells * steps + 1) / (cells * steps) - 0.5) * size_m, np.float64)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _average(
    samples: NDArray[np.float64],
    tops: NDArray[np.int64],
    lefts: NDArray[np.int64],
    steps: int,
    dx: float,
    dy: float,
    mean: NDArray[np.float64],
    slope: NDArray[np.float64],
) -> None:
    """Write the mean (n,) and the mean slopes (2, n) of samples over cells, by the trapezoidal rule along each axis.

    The samples of cell i begin in row `tops[i]` and column `lefts[i]`.
    """
    for i in range(mean.size):
        top, left = tops[i], lefts[i]
        total = above = below = 0.0
        first = last = 0.0
        for k in range(steps + 1):
            line, weight = samples[top + k], 0.5 if k in (0, steps) else 1.0
            across = 0.5 * (line[left] + line[left + steps])
            for j in range(left + 1, left + steps):
                across += line[j]
            total += weight * across
            first += weight * line[left]
            last += weight * line[left + steps]
            if k == 0:
                above = across
            below = across
        mean[i] = total / steps**2
        slope[0, i] = (last - first) / (steps * dx)
        slope[1, i] = (below - above) / (steps * dy)
