"""Means of an object's surface over cells: as sampled cell by cell, for any set of cells and any placement."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lsds_mocks.gel.field.footprint import Footprint
from lsds_mocks.gel.field.grid import CellGrid
from lsds_mocks.gel.material import GelMaterial
from lsds_mocks.gel.placement import Placement
from lsds_mocks.gel.shapes import Box, Cylinder, Flat, Sphere
from lsds_mocks.objects.relief import Relief, weave

SHAPES = {
    "flat": Flat(),
    "sphere": Sphere(9e-3),
    "cylinder": Cylinder(11e-3, 0.1, 0.3),
    "box": Box(9e-3, 12e-3, 1.5e-3, -0.2),
    "weave": Relief(Sphere(20e-3), weave(period_m=2e-3, depth_m=0.1e-3), 0.12e-3),
}
places = st.builds(Placement, st.floats(-5e-3, 5e-3), st.floats(-5e-3, 5e-3), st.sampled_from([0.0, 0.4, -2.0]))


def by_cell(shape, grid, cell, place, steps):
    """Return mean gap, and mean slopes, of one cell: the trapezoidal rule, point by point."""
    x, y = grid.centres_m(np.array([cell]))[:, 0]
    gap = np.empty((steps + 1, steps + 1))
    cos, sin = math.cos(place.angle_rad), math.sin(place.angle_rad)
    for k in range(steps + 1):
        for j in range(steps + 1):
            dx = x + (j / steps - 0.5) * grid.dx_m - place.x_m
            dy = y + (k / steps - 0.5) * grid.dy_m - place.y_m
            gap[k, j] = shape.gap(np.array([cos * dx + sin * dy]), np.array([cos * dy - sin * dx]))[0]
    weight = np.ones(steps + 1)
    weight[[0, -1]] = 0.5
    weight /= steps
    return (
        weight @ gap @ weight,
        weight @ (gap[:, -1] - gap[:, 0]) / grid.dx_m,
        (gap[-1] - gap[0]) @ weight / grid.dy_m,
    )


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(sorted(SHAPES)), st.sampled_from([(1, 8), (2, 4), (4, 2)]), places, st.data())
def test_means_are_those_of_each_cell_alone(name, fineness, place, data):
    fine, steps = fineness
    shape, grid = SHAPES[name], CellGrid(GelMaterial(), fine)
    cells = data.draw(st.lists(st.integers(0, grid.size - 1), min_size=1, max_size=5, unique=True))
    gap, slope = Footprint(shape, grid).over(np.array(cells, np.int32), place)
    expected = np.array([by_cell(shape, grid, cell, place, steps) for cell in cells])
    # A map's positions are single precision.
    close = 1e-8 if name == "weave" else 1e-14
    np.testing.assert_allclose(gap, expected[:, 0], atol=close)
    np.testing.assert_allclose(slope.T, expected[:, 1:], atol=close / grid.dx_m * 10)


def test_no_cells_have_no_means():
    gap, slope = Footprint(Flat(), CellGrid(GelMaterial(), 1)).over(np.zeros(0, np.int32), Placement(0.0, 0.0, 0.0))
    assert (gap.shape, slope.shape) == ((0,), (2, 0))


def test_the_mean_of_a_sphere_is_that_of_its_paraboloid():
    grid = CellGrid(GelMaterial(), 4)
    gap, slope = Footprint(Sphere(10e-3), grid).over(np.arange(grid.size, dtype=np.int32), Placement(0.0, 0.0, 0.0))
    x, y = grid.centres_m(np.arange(grid.size, dtype=np.int32))
    # The trapezoidal rule with two steps overestimates the mean of a square by twice as much as it adds itself.
    assert gap == pytest.approx((x**2 + y**2) / 20e-3, abs=2 * grid.dx_m**2 / 20e-3)
    np.testing.assert_allclose(slope, np.stack([x, y]) / 10e-3, atol=1e-9)
