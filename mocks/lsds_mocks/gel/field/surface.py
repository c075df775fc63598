"""Observable quantities of a gel state: marker positions, surface depth, contact area.

The free surface is smooth, so forces on fine cells are summed over cells of a whole hat, and one dense matrix gives the
depth of those. Next to the contact of round objects the error is some micrometres, at a block's edge ten. Within the
contact the depth is the object's own surface. Between cells the depth is a cubic with continuous slope (Catmull and Rom
1974), because a kink would show as a step in colour.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from lsds_mocks.byte_cache import kept
from lsds_mocks.gel.field.correction import hats_of, reading
from lsds_mocks.gel.field.dense import Patch
from lsds_mocks.gel.field.footprint import own_coordinates
from lsds_mocks.gel.field.operator import POINT_FINE, operator
from lsds_mocks.gel.placement import Placement

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.grid import CellGrid
    from lsds_mocks.gel.field.operator import Kernel, Operator
    from lsds_mocks.gel.material import GelMaterial
    from lsds_mocks.gel.shapes import Shape
    from lsds_mocks.gel.state import GelState


class FreeSurface:
    """Depth (H, W) of the surface on an image's rows and columns; weights are cached between calls."""

    def __init__(self, material: GelMaterial, kernel: Kernel) -> None:
        self._grid = operator(material, 1, kernel).grid
        self._of = (material, kernel)
        self._axes: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
        self._across = self._down = np.zeros((0, 0), np.float32)

    def depth(
        self, state: GelState, grid: CellGrid, x_m: NDArray[np.float64], y_m: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """Return the depth (H, W) in metres of a state on `grid`; negative values are bulges."""
        if self._axes is None or not all(map(np.array_equal, self._axes, (x_m, y_m))):
            self._axes = (x_m, y_m)
            self._across = _between(self._grid.x_m, x_m).T.astype(np.float32).copy()
            self._down = _between(self._grid.y_m, y_m).astype(np.float32)
        sunk = np.zeros(self._grid.size, np.float32)
        sink(sunk, _depths(*self._of), state.cells, state.shear_n, state.pressure_n, grid.fine, grid.columns)
        sunk *= np.float32(1 / self._grid.cell_m2)
        return np.asarray(self._down @ sunk.reshape(self._grid.rows, -1) @ self._across, np.float32)


@kept
def _depths(material: GelMaterial, kernel: Kernel) -> NDArray[np.float32]:
    """Return (cells, 3, cells): depth of all cells per traction (x, y, pressure) in each cell, m/Pa."""
    patch = Patch(operator(material, 1, kernel))
    patch.add(np.arange(patch.operator.grid.size, dtype=np.int32))
    return patch.depths()


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def sink(
    sunk: NDArray[np.float32],
    depths: NDArray[np.float32],
    cells: NDArray[np.int32],
    shear_n: NDArray[np.float64],
    pressure_n: NDArray[np.float64],
    fine: int,
    columns: int,
) -> None:
    """Add to `sunk` (coarse cells,) the depth due to forces on `cells` of a `fine` times finer grid, times area."""
    whole = sunk.size
    force = np.zeros((whole, 3), np.float32)
    for i in range(cells.size):
        into = cells[i] // columns // fine * (columns // fine) + cells[i] % columns // fine
        force[into, 0] += shear_n[0, i]
        force[into, 1] += shear_n[1, i]
        force[into, 2] += pressure_n[i]
    for c in range(whole):
        fx, fy, fz = force[c, 0], force[c, 1], force[c, 2]
        if fx == 0.0 and fy == 0.0 and fz == 0.0:
            continue
        row = depths[c]
        for k in range(whole):
            sunk[k] += fx * row[0, k] + fy * row[1, k] + fz * row[2, k]


def _between(knots: NDArray[np.float64], at: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (A, K): weights of a Catmull-Rom cubic through evenly spaced knots, straight at its ends."""
    place = np.clip((at - knots[0]) / (knots[1] - knots[0]), 0, len(knots) - 1)
    first = np.minimum(place.astype(int), len(knots) - 2)
    t = place - first
    cubic = (
        (-0.5 * t + t**2 - 0.5 * t**3),
        (1 - 2.5 * t**2 + 1.5 * t**3),
        (0.5 * t + 2 * t**2 - 1.5 * t**3),
        (-0.5 * t**2 + 0.5 * t**3),
    )
    # A knot beyond either end lies on the line through the last two.
    weights = np.zeros((len(at), len(knots) + 2))
    for offset, weight in enumerate(cubic):
        np.add.at(weights, (np.arange(len(at)), first + offset), weight)
    inner = weights[:, 1:-1].copy()
    inner[:, 0] += 2 * weights[:, 0]
    inner[:, 1] -= weights[:, 0]
    inner[:, -1] += 2 * weights[:, -1]
    inner[:, -2] -= weights[:, -1]
    return inner


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def point_correction(
    out: NDArray[np.float32],
    node: NDArray[np.int64],
    weight: NDArray[np.float32],
    correction: NDArray[np.float32],
) -> None:
    """Write (3, nodes, 2 M): the correction from hats to points; each point uses hats `node` with `weight` (M, K)."""
    points, many = node.shape
    for a in range(3):
        for n in range(correction.shape[1]):
            for b in range(2):
                source, own = correction[a, n, b], out[a, n]
                for m in range(points):
                    value = np.float32(0.0)
                    for h in range(many):
                        value += weight[m, h] * source[node[m, h]]
                    own[b * points + m] = value


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def point_rows(
    out: NDArray[np.float32],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    table: NDArray[np.float32],
    from_hats: NDArray[np.float32],
    fine: int,
    point_fine: int,
    hat_rows: int,
    hat_columns: int,
) -> None:
    """Write (N, 3, 2 M): displacement of points `x`, `y` (M,), in hat intervals from the corner, per cell traction.

    `from_hats` is the result of `point_correction`, of size 0 without a correction.
    """
    ny, nx = table.shape[2], table.shape[3]
    points = x.size
    node, weight = np.zeros(4, np.int64), np.zeros(4)
    one = np.float32(1.0)
    for i in range(rows.size):
        cy, cx = (rows[i] + 0.5) / fine, (columns[i] + 0.5) / fine
        for m in range(points):
            oy, ox = (y[m] - cy) * point_fine, (x[m] - cx) * point_fine
            r, c = int(np.floor(oy)), int(np.floor(ox))
            fy, fx = np.float32(oy - r), np.float32(ox - c)
            r0, r1, c0, c1 = r % ny, (r + 1) % ny, c % nx, (c + 1) % nx
            for a in range(3):
                for b in range(2):
                    t = table[b, a]
                    value = (one - fy) * ((one - fx) * t[r0, c0] + fx * t[r0, c1])
                    value += fy * ((one - fx) * t[r1, c0] + fx * t[r1, c1])
                    out[i, a, b * points + m] = value
        if from_hats.size:
            hats_of(cy, cx, hat_rows, hat_columns, node, weight)
            for h in range(4):
                w = np.float32(weight[h])
                for a in range(3):
                    source, own = from_hats[a, node[h]], out[i, a]
                    for k in range(2 * points):
                        own[k] += w * source[k]


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def displace(
    out: NDArray[np.float32], rows: NDArray[np.float32], which: NDArray[np.int64], traction: NDArray[np.float32]
) -> None:
    """Add the displacement due to cells `which` of `rows` (., 3, 2 M) under `traction` (3, N) to `out` (2 M,)."""
    out[:] = 0.0
    for i in range(which.size):
        row = rows[which[i]]
        tx, ty, p = traction[0, i], traction[1, i], traction[2, i]
        if tx == 0.0 and ty == 0.0 and p == 0.0:
            continue
        for m in range(out.size):
            out[m] += tx * row[0, m] + ty * row[1, m] + p * row[2, m]


_SETS = 4
"""Sets of points whose matrices are cached: two fingers, the points of an audit, one to spare."""


class FieldView:
    """Observes states on one operator's grid; caches the matrices per cell and set of points."""

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
        """Return the depth (H, W) in metres below the flat surface: the greater of the object's and the free gel's."""
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
    """The effect of traction on each cell on one set of points (M, 2), computed when a cell is first used."""

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


@kept
def _point_correction(operator: Operator, xy: bytes) -> NDArray[np.float32]:
    """Return the correction from hats to points (3, nodes, 2 M), of size 0 without a correction."""
    if not operator.correction.size:
        return np.zeros((3, 0, 0), np.float32)
    x, y = _in_hats(operator, np.frombuffer(xy).reshape(-1, 2))
    out = np.zeros((3, operator.correction.shape[1], 2 * len(x)), np.float32)
    point_correction(out, *reading(operator.grid.hats, x, y), operator.correction)
    return out


def _traction(state: GelState, area_m2: float) -> NDArray[np.float32]:
    return np.concatenate([state.shear_n, state.pressure_n[None]]).astype(np.float32) / np.float32(area_m2)


def _overlap(centre: NDArray[np.float64], size: float, window: float) -> NDArray[np.float64]:
    """Return the length (m) of each interval within a centred window."""
    low, high = np.maximum(centre - size / 2, -window / 2), np.minimum(centre + size / 2, window / 2)
    return np.asarray(np.maximum(high - low, 0))
