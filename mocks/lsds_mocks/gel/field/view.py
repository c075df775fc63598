"""What a state of the gel looks like: where dots go, how deep the surface lies, how much of it is touched."""

from __future__ import annotations

from collections import deque
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.gel.field.blocks import displace, point_correction, point_rows
from lsds_mocks.gel.field.footprint import own_coordinates
from lsds_mocks.gel.field.points import reading
from lsds_mocks.gel.field.surface import FreeSurface
from lsds_mocks.gel.field.tables import POINT_FINE
from lsds_mocks.gel.placement import Placement

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.operator import Operator
    from lsds_mocks.gel.shapes import Shape
    from lsds_mocks.gel.state import GelState

_SETS = 4
"""Sets of points whose matrices are kept: two fingers, the dots of an audit, one to spare."""


class FieldView:
    """Looks at states of one operator's grid; keeps what it worked out for each cell and set of points."""

    def __init__(self, operator: Operator, shape: Shape) -> None:
        self._operator = operator
        self._shape = shape
        self._seen: deque[_PointMatrices] = deque(maxlen=_SETS)
        self._free = FreeSurface(operator.grid.material, operator.kernel)

    def marker_displacement(self, state: GelState, xy_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (M, 2) metres for points (M, 2) of the undeformed surface."""
        return self.displacement(state.cells, _traction(state, self._operator.grid.cell_m2), xy_m)

    def displacement(
        self, cells: NDArray[np.int32], traction: NDArray[np.float32], xy_m: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return (M, 2) metres for points (M, 2), under traction (3, N) in pascal on cells (N,)."""
        matrices = next((known for known in self._seen if known.xy_m is xy_m), None)
        if matrices is None:
            matrices = _PointMatrices(self._operator, xy_m)
            self._seen.append(matrices)
        return matrices.displacement(cells, traction)

    def depth(self, state: GelState, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return (H, W) metres below the flat surface: the object's own surface where it is deepest, else the gel's."""
        gel = self._free.depth(state, self._operator.grid, x_m, y_m)
        if state.indentation_m > 0:
            place = Placement(*state.placement)
            stands = state.indentation_m - self._shape.gap(*own_coordinates(place, x_m[None, :], y_m[:, None]))
            if state.reach_m is not None:
                under = (y_m >= state.reach_m[0]) & (y_m <= state.reach_m[1])
                stands = np.where(under[:, None], stands, -1.0)
            np.maximum(gel, stands, out=gel, casting="same_kind")
        return gel

    def contact_fraction(self, state: GelState, width_m: float, height_m: float) -> float:
        """Return the fraction of a centred window that the object touches."""
        grid = self._operator.grid
        touching = state.cells[state.pressure_n > 0]
        across = _overlap(grid.x_m, grid.dx_m, width_m)[touching % grid.columns]
        along = _overlap(grid.y_m, grid.dy_m, height_m)[touching // grid.columns]
        return float(across @ along) / (width_m * height_m)


class _PointMatrices:
    """What traction on each cell does to one set of points (M, 2), worked out when a cell is first asked for."""

    def __init__(self, operator: Operator, xy_m: NDArray[np.float64]) -> None:
        self.xy_m = xy_m
        self._operator = operator
        self._out = np.zeros(2 * len(xy_m), np.float32)
        self._slot = np.full(operator.grid.size, -1, np.int64)
        self._rows = np.zeros((64, 3, 2 * len(xy_m)), np.float32)
        self._used = 0
        self._from_hats = _point_correction(operator, xy_m.tobytes())

    def displacement(self, cells: NDArray[np.int32], traction: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return (M, 2) metres under traction (3, N) in pascal on cells (N,)."""
        self._learn(cells)
        displace(self._out, self._rows, self._slot[cells], traction)
        return np.asarray(self._out.reshape(2, -1).T, np.float64)

    def _learn(self, cells: NDArray[np.int32]) -> None:
        new = cells[self._slot[cells] < 0]
        if not len(new):
            return
        known, self._used = self._used, self._used + len(new)
        if self._used > len(self._rows):
            more = np.zeros((self._used * 5 // 4, *self._rows.shape[1:]), np.float32)
            more[:known] = self._rows[:known]
            self._rows = more
        operator = self._operator
        grid, hats = operator.grid, operator.grid.hats
        x, y = _in_hats(operator, self.xy_m)
        rows, columns = (new // grid.columns).astype(np.int32), (new % grid.columns).astype(np.int32)
        to_fill = self._rows[known : self._used]
        size = (grid.fine, POINT_FINE, hats.rows, hats.columns)
        point_rows(to_fill, x, y, rows, columns, operator.points, self._from_hats, *size)
        self._slot[new] = np.arange(known, self._used)


def _in_hats(operator: Operator, xy_m: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return x and y of points in hat intervals from the pad's corner."""
    hats, material = operator.grid.hats, operator.grid.material
    x = (xy_m[:, 0] / material.width_m + 0.5) * hats.columns
    y = (xy_m[:, 1] / material.height_m + 0.5) * hats.rows
    return x, y


@lru_cache(maxsize=8)
def _point_correction(operator: Operator, xy: bytes) -> NDArray[np.float32]:
    """Return the correction from hats to points (3, nodes, 2 M), of size 0 where there is none."""
    if not operator.correction.size:
        return np.zeros((3, 0, 0), np.float32)
    x, y = _in_hats(operator, np.frombuffer(xy).reshape(-1, 2))
    out = np.zeros((3, operator.correction.shape[1], 2 * len(x)), np.float32)
    point_correction(out, *reading(operator.grid.hats, x, y), operator.correction)
    return out


def _traction(state: GelState, area_m2: float) -> NDArray[np.float32]:
    return np.concatenate([state.shear_n, state.pressure_n[None]]).astype(np.float32) / np.float32(area_m2)


def _overlap(centre: NDArray[np.float64], size: float, window: float) -> NDArray[np.float64]:
    """Return how much (m) of each interval lies in a centred window."""
    low, high = np.maximum(centre - size / 2, -window / 2), np.minimum(centre + size / 2, window / 2)
    return np.asarray(np.maximum(high - low, 0))
