"""Loads on the shipped pad by which its correction is judged, and what the product says of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from lsds_mocks.gel.field.operator import operator
from lsds_mocks.gel.field.surface import FieldView
from lsds_mocks.gel.material import GelMaterial

WIDTH_MM, HEIGHT_MM, THICKNESS_MM = 24.96, 20.16, 4.0
TRACTION_PA = 1e3
X_MM, Y_MM = np.arange(-8.0, 9.0, 2.0), np.arange(-6.0, 7.0, 2.0)
"""The dots, 9 x 7, 2 mm apart."""


@dataclass(frozen=True)
class Load:
    """Traction of 1 kPa along x, y, or into the gel, over a rectangle of cells of 0.48 mm, counted from the corner."""

    column: int
    row: int
    columns: int
    rows: int
    direction: int

    @property
    def box_mm(self):
        """Left, right, lower and upper edge."""
        left, low = 0.48 * self.column - WIDTH_MM / 2, 0.48 * self.row - HEIGHT_MM / 2
        return left, left + 0.48 * self.columns, low, low + 0.48 * self.rows


PATCHES = {
    "2 mm, middle": (24, 19, 4, 4),
    "4 mm, middle": (20, 18, 8, 8),
    "8 mm, middle": (18, 14, 16, 16),
    "1 mm, middle": (25, 20, 2, 2),
    "2 mm, 1 mm from a wall": (46, 18, 4, 4),
    "2 mm, 1 mm from the other wall": (20, 36, 4, 4),
    "2 mm, at a wall": (48, 20, 4, 4),
    "2 mm, at the other wall": (25, 38, 4, 4),
    "2 mm, in a corner": (48, 38, 4, 4),
    "8 mm, at a wall": (36, 12, 16, 16),
    "1 mm, at a wall": (50, 20, 2, 2),
    "1 mm, in a corner": (50, 40, 2, 2),
    "strip across": (24, 0, 6, 42),
    "strip along a wall": (48, 0, 4, 42),
    "everywhere": (0, 0, 52, 42),
}
LOADS = {f"{name}, {'xyp'[d]}": Load(*patch, d) for name, patch in PATCHES.items() for d in range(3)}


def product_um(poisson, fine=2, loads=LOADS, material=None):
    """Return (loads, 2, 7, 9): how far the product moves the dots."""
    pad = operator(material or GelMaterial(poisson=poisson), fine, "pad")
    view, grid = FieldView(pad, None), pad.grid
    x, y = np.meshgrid(X_MM * 1e-3, Y_MM * 1e-3)
    dots = np.stack([x.ravel(), y.ravel()], axis=1)
    found = []
    for load in loads.values():
        left, right, low, high = load.box_mm
        within_x = (grid.x_m * 1e3 > left) & (grid.x_m * 1e3 < right)
        within_y = (grid.y_m * 1e3 > low) & (grid.y_m * 1e3 < high)
        cells = np.flatnonzero(within_y[:, None] & within_x).astype(np.int32)
        traction = np.zeros((3, len(cells)), np.float32)
        traction[load.direction] = TRACTION_PA
        found.append(view.displacement(cells, traction, dots).T.reshape(2, *x.shape) * 1e6)
    return np.array(found)


def errors(found_um, reference_um):
    """Return (loads,): greatest error of a dot as part of the greatest motion."""
    off = np.hypot(*np.moveaxis(found_um - reference_um, 1, 0)).max(axis=(1, 2))
    return off / np.hypot(*np.moveaxis(reference_um, 1, 0)).max(axis=(1, 2))
