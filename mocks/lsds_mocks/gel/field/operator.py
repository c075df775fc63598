"""The elastic answer of a pad's surface: tables and correction for one grid, ready for gathering."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from lsds_mocks.gel.field.correction import pad_correction
from lsds_mocks.gel.field.grid import CellGrid
from lsds_mocks.gel.field.halfspace import halfspace_tables
from lsds_mocks.gel.field.tables import cell_table, point_table

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.material import GelMaterial

Kernel = Literal["half-space", "layer", "pad"]


@dataclass(frozen=True, eq=False)
class Operator:
    """`cells` (3, 3, Ny, Nx) and `points` (2, 3, Ny8, Nx8) in metres per pascal, periodic in their last two axes;
    `correction` (3, nodes, 3, nodes), metres per pascal in a cell, of size 0 where the kernel has none."""

    grid: CellGrid
    kernel: Kernel
    cells: NDArray[np.float32]
    points: NDArray[np.float32]
    correction: NDArray[np.float32]


@lru_cache(maxsize=12)
def operator(material: GelMaterial, fine: int, kernel: Kernel) -> Operator:
    """Return the operator for a grid of `fine` cells per hat.

    Raises DataError where the kernel is `pad` and no correction for this pad is at hand.
    """
    grid = CellGrid(material, fine)
    none = np.zeros((3, 0, 3, 0), np.float32)
    if kernel == "half-space":
        return Operator(grid, kernel, *halfspace_tables(grid), none)
    # Before tables that take a while: there may be none for this pad.
    correction = pad_correction(material) * np.float32(grid.cell_m2) if kernel == "pad" else none
    softness = np.float32(material.thickness_m / material.shear_modulus_pa)
    cells = softness * cell_table(grid.hats, fine, material.poisson)
    points = softness * point_table(grid.hats, fine, material.poisson)
    return Operator(grid, kernel, cells, points, correction)
