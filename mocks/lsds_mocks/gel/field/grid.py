"""Grids of a pad: hats that carry the finite-pad correction, and contact cells that are whole fractions of a hat.

Cells are rectangles of constant traction; a cell's displacement is its mean over the cell, which makes the discrete
operator symmetric and positive, and contact forces accurate to a fraction of a cell. Cell (row, column) counts from
the pad's corner at -x, -y; the flat number is row x columns + column.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.material import GelMaterial

HATS_PER_THICKNESS = 4.0 / 0.96
"""Hat intervals per thickness: hats are 0.96 mm apart on a gel of 4 mm."""
PERIOD = 1.5
"""Least period of the layer, in pads; the correction removes the effect of the repetition."""


@dataclass(frozen=True, slots=True)
class HatGrid:
    """Bilinear hats over a pad of `columns` x `rows` intervals, in a layer that repeats after `period_x` x `period_y`
    of them; lengths in units of the thickness."""

    columns: int
    rows: int
    period_x: int
    period_y: int
    pitch_x: float
    pitch_y: float

    @property
    def nodes(self) -> int:
        """Number of hats, those at the walls included."""
        return (self.columns + 1) * (self.rows + 1)


def hat_grid(material: GelMaterial) -> HatGrid:
    """Return the hats of a pad."""
    width, height = material.width_m / material.thickness_m, material.height_m / material.thickness_m
    columns, rows = (max(4, round(size * HATS_PER_THICKNESS)) for size in (width, height))
    return HatGrid(columns, rows, _period(columns), _period(rows), width / columns, height / rows)


def _period(intervals: int) -> int:
    """Return the least number 2^a 5^b, a > 2, of at least `PERIOD` pads; such lengths have a fast transform."""
    least = PERIOD * intervals
    return min(int(2**a * 5**b) for a in range(3, 16) for b in range(4) if 2**a * 5**b >= least)


@dataclass(frozen=True)
class CellGrid:
    """`fine` x `fine` cells per hat interval on a pad of the given material."""

    material: GelMaterial
    fine: int

    @cached_property
    def hats(self) -> HatGrid:
        """The hats that the cells divide."""
        return hat_grid(self.material)

    @property
    def columns(self) -> int:
        """Cells along x."""
        return self.hats.columns * self.fine

    @property
    def rows(self) -> int:
        """Cells along y."""
        return self.hats.rows * self.fine

    @property
    def size(self) -> int:
        """All cells."""
        return self.rows * self.columns

    @property
    def dx_m(self) -> float:
        """Width of a cell."""
        return self.material.width_m / self.columns

    @property
    def dy_m(self) -> float:
        """Height of a cell."""
        return self.material.height_m / self.rows

    @property
    def cell_m2(self) -> float:
        """Area of a cell."""
        return self.dx_m * self.dy_m

    @property
    def pitch_m(self) -> float:
        """Geometric mean of a cell's sides, by which reports identify a grid."""
        return float(np.sqrt(self.cell_m2))

    @cached_property
    def x_m(self) -> NDArray[np.float64]:
        """Centres of the columns."""
        return np.asarray((np.arange(self.columns) + 0.5) * self.dx_m - self.material.width_m / 2, np.float64)

    @cached_property
    def y_m(self) -> NDArray[np.float64]:
        """Centres of the rows."""
        return np.asarray((np.arange(self.rows) + 0.5) * self.dy_m - self.material.height_m / 2, np.float64)

    def centres_m(self, cells: NDArray[np.int32]) -> NDArray[np.float64]:
        """Return centres (2, N) of numbered cells (N,)."""
        return np.stack([self.x_m[cells % self.columns], self.y_m[cells // self.columns]])
