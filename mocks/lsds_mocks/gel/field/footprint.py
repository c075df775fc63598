"""Gap and slope of an object over the cells, as means over each cell, at any placement of the object."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

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
    """Cell means of gap (n,) and slope of the gap along x and y (2, n), for one shape on one grid."""

    def __init__(self, shape: Shape, grid: CellGrid) -> None:
        self.shape = shape
        self._grid = grid
        steps = max(1, _SURFACE_SAMPLES // grid.fine)
        self._offset = np.arange(steps + 1) / steps - 0.5
        ends = np.ones(steps + 1)
        ends[[0, -1]] = 0.5
        self._weight = ends / steps

    def over(self, cells: NDArray[np.int32], place: Placement) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return gap and slope over numbered cells. The slope's mean is exact: the gap's rise from edge to edge."""
        x, y = self._grid.centres_m(cells)
        dx, dy = self._grid.dx_m, self._grid.dy_m
        at = own_coordinates(
            place,
            x[:, None, None] + (self._offset * dx)[None, None, :],
            y[:, None, None] + (self._offset * dy)[None, :, None],
        )
        gap = np.broadcast_to(self.shape.gap(*at), (len(cells), len(self._weight), len(self._weight)))
        along, across = gap @ self._weight, self._weight @ gap
        slope = np.stack([(across[:, -1] - across[:, 0]) / dx, (along[:, -1] - along[:, 0]) / dy])
        return along @ self._weight, slope

    def near(self, place: Placement, reach_m: float) -> NDArray[np.bool_]:
        """Return (cells,): whether the gap without texture at the cell's centre is below `reach_m`."""
        at = own_coordinates(place, self._grid.x_m[None, :], self._grid.y_m[:, None])
        gap = np.broadcast_to(self.shape.least_gap(*at), (self._grid.rows, self._grid.columns))
        return np.asarray(gap < reach_m).ravel()
