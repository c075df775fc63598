"""The free surface that the camera sees, against the depth of every cell of the contact's own grid."""

import numpy as np
import pytest
from lsds_mocks.gel.field.box import Box
from lsds_mocks.gel.field.gel import FieldGel
from lsds_mocks.gel.field.surface import FreeSurface
from lsds_mocks.gel.shapes import Box as Block
from lsds_mocks.gel.shapes import Cylinder, Sphere

SHAPES = {"sphere": Sphere(12e-3), "pipe": Cylinder(12.5e-3, 60e-3), "block": Block(10e-3, 10e-3, edge_m=1e-3)}


def sheared(shape, fine, kernel="pad"):
    gel = FieldGel(shape, fine=fine, kernel=kernel)
    gel.press(0.3e-3)
    for _ in range(4):
        gel.set_friction(np.full(gel.points_m.shape[1], 0.6))
        gel.trial(30e-6, 60e-6)
        gel.commit()
    return gel


def exact(gel):
    """Depth (rows, columns) of all cells of the contact's grid, by transforms."""
    grid, state = gel.grid, gel.state()
    load = np.zeros((3, grid.size), np.float32)
    load[:, state.cells] = np.vstack([state.shear_n, state.pressure_n]) / grid.cell_m2
    out = np.empty((1, grid.rows, grid.columns), np.float32)
    Box(gel.operator, 0, 0, grid.rows, grid.columns).respond(load.reshape(3, grid.rows, -1), out, first=2)
    return out[0]


@pytest.mark.parametrize("kernel", ["pad", "half-space", "layer"])
def test_on_its_own_grid_it_is_the_answer_to_what_the_cells_carry(kernel):
    gel = sheared(SHAPES["sphere"], 1, kernel)
    found = FreeSurface(gel.material, kernel).depth(gel.state(), gel.grid, gel.grid.x_m, gel.grid.y_m)
    whole = exact(gel)
    assert np.abs(whole).max() > 0.1e-3
    np.testing.assert_allclose(found, whole, rtol=0, atol=1e-4 * np.abs(whole).max())


@pytest.mark.parametrize("scene", SHAPES)
@pytest.mark.parametrize("fine", [2, 4])
def test_beside_the_contact_of_a_finer_grid_it_is_right_to_micrometres(scene, fine):
    gel = sheared(SHAPES[scene], fine)
    grid, state = gel.grid, gel.state()
    off = np.abs(FreeSurface(gel.material, "pad").depth(state, grid, grid.x_m, grid.y_m) - exact(gel))
    touching = np.zeros(grid.size, bool)
    touching[state.cells[state.pressure_n > 0]] = True
    near = np.array(np.nonzero(touching.reshape(grid.rows, -1))).T
    rows, columns = np.mgrid[0 : grid.rows, 0 : grid.columns]
    away = np.sqrt(((np.stack([rows, columns], axis=-1)[:, :, None] - near) ** 2).sum(axis=-1).min(axis=2)) / fine
    inner = (np.abs(grid.x_m) < 10e-3)[None, :] & (np.abs(grid.y_m) < 7.5e-3)[:, None]
    outside, far = off[inner & (away > 0.6)], off[inner & (away > 2)]
    print(f"{scene}, {fine}: outside {outside.max() * 1e6:.1f} um, rms {np.sqrt((outside**2).mean()) * 1e6:.2f} um")
    # A coarse cell cannot follow the gel where it leaves an edge.
    assert np.sqrt((outside**2).mean()) < (10e-6 if scene == "block" else 4e-6)
    assert far.size == 0 or far.max() < 8e-6


def test_the_image_is_between_the_cells_without_kinks():
    gel = sheared(SHAPES["sphere"], 2)
    x, y = np.linspace(-9e-3, 9e-3, 721), np.array([0.0])
    depth = FreeSurface(gel.material, "pad").depth(gel.state(), gel.grid, x, y)[0]
    slope = np.diff(depth) / np.diff(x)
    assert np.abs(np.diff(slope)).max() < 0.1 * np.abs(slope).max()


def test_nothing_in_contact_is_flat():
    gel = FieldGel(SHAPES["sphere"])
    depth = FreeSurface(gel.material, "pad").depth(gel.state(), gel.grid, np.linspace(-1, 1, 5), np.linspace(-1, 1, 3))
    assert depth.shape == (3, 5)
    assert not depth.any()
