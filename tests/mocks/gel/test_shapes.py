"""Which motions carry a shape along itself: what is not looked up again must not have changed."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from lsds_mocks.gel.field.footprint import Footprint
from lsds_mocks.gel.field.grid import CellGrid
from lsds_mocks.gel.material import GelMaterial
from lsds_mocks.gel.placement import Placement
from lsds_mocks.gel.shapes import Box, Cylinder, Flat, Moved, Sphere

PAD_M = (GelMaterial().width_m, GelMaterial().height_m)
GRID = CellGrid(GelMaterial(), 1)
CELLS = np.arange(GRID.size, dtype=np.int32)
small = st.floats(-3e-3, 3e-3)
turn = st.sampled_from([0.0, math.pi / 2, 0.3]) | st.floats(-1.0, 1.0)
step = st.sampled_from([0.0, 0.1e-3, -1e-3])
shapes = st.one_of(
    st.builds(Box, st.sampled_from([10e-3, 26e-3, 60e-3]), st.sampled_from([12e-3, 30e-3, 10.0]), angle_rad=turn),
    st.builds(Cylinder, st.just(12e-3), st.just(0.1), turn),
    st.just(Flat()),
    st.just(Sphere(12e-3)),
)
shapes = shapes | st.builds(Moved, shapes, small, small)


@given(shapes, st.builds(Placement, small, small, turn), st.tuples(step, step, st.sampled_from([0.0, 0.02])))
def test_a_shape_that_slides_along_itself_stays_as_it_is(shape, place, motion):
    if shape.slides_along(place, motion, PAD_M):
        footprint = Footprint(shape, GRID)
        before, after = footprint.over(CELLS, place), footprint.over(CELLS, place.moved(*motion))
        assert np.abs(after[0] - before[0]).max() < 1e-12
        assert np.abs(after[1] - before[1]).max() < 1e-9


def test_a_face_slides_along_itself_only_while_its_edges_are_beyond_the_pad():
    plank, book = Box(40e-3, 40e-3), Box(18e-3, 10.0)
    away, along, turned = (0.1e-3, 0.0, 0.0), (0.0, 0.1e-3, 0.0), (0.0, 0.0, 0.1)
    here, far = Placement(), Placement(8e-3, 0.0)
    assert plank.slides_along(here, away, PAD_M)
    assert plank.slides_along(here, turned, PAD_M)
    assert not plank.slides_along(far, away, PAD_M)
    assert plank.slides_along(far, along, PAD_M)
    assert book.slides_along(here, along, PAD_M)
    assert not book.slides_along(here, away, PAD_M)
    assert not book.slides_along(here, turned, PAD_M)
    assert not Moved(plank, 8e-3, 0.0).slides_along(here, away, PAD_M)
