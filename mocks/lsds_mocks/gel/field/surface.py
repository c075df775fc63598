"""The depth of the gel's free surface, for the camera: smooth, so coarse cells carry it, whatever grid contact is on.

Forces on fine cells are added up on cells of a whole hat, and the depth of those read from one dense matrix. Beside
the contact of round things that is right to some micrometres, ten at a block's edge; inside, the object's own surface
is what is seen. Between cells the depth is a cubic with continuous slope (Catmull and Rom 1974): a kink in it would be
seen as a step in colour.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from lsds_mocks.gel.field.operator import operator
from lsds_mocks.gel.field.patch import Patch

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.grid import CellGrid
    from lsds_mocks.gel.field.operator import Kernel
    from lsds_mocks.gel.material import GelMaterial
    from lsds_mocks.gel.state import GelState


class FreeSurface:
    """Depth (H, W) of the surface on an image's rows and columns, which are kept from call to call."""

    def __init__(self, material: GelMaterial, kernel: Kernel) -> None:
        self._grid = operator(material, 1, kernel).grid
        self._of = (material, kernel)
        self._axes: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
        self._across = self._down = np.zeros((0, 0), np.float32)

    def depth(
        self, state: GelState, grid: CellGrid, x_m: NDArray[np.float64], y_m: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """Return metres (H, W), negative where the gel bulges, of a state on `grid`."""
        if self._axes is None or not all(map(np.array_equal, self._axes, (x_m, y_m))):
            self._axes = (x_m, y_m)
            self._across = _between(self._grid.x_m, x_m).T.astype(np.float32).copy()
            self._down = _between(self._grid.y_m, y_m).astype(np.float32)
        sunk = np.zeros(self._grid.size, np.float32)
        sink(sunk, _depths(*self._of), state.cells, state.shear_n, state.pressure_n, grid.fine, grid.columns)
        sunk *= np.float32(1 / self._grid.cell_m2)
        return np.asarray(self._down @ sunk.reshape(self._grid.rows, -1) @ self._across)


@lru_cache(maxsize=4)
def _depths(material: GelMaterial, kernel: Kernel) -> NDArray[np.float32]:
    """Return (cells, 3, cells): what traction (x, y, pressure) in a cell does to the depth of all, m/Pa."""
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
    """Add to `sunk` (coarse cells,) what forces on `cells` of a grid `fine` times finer do, times a cell's area."""
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
    """Return (A, K): weights that read a Catmull-Rom cubic through evenly spaced knots, straight at its ends."""
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
