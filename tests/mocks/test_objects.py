"""Objects: the catalogue, textures, height maps from files, and what makes no sense."""

import cv2
import numpy as np
import pytest
from lsds_mocks.cell.build import build_cell, build_surface
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.gel.field.gel import FieldGel
from lsds_mocks.gel.material import GelMaterial
from lsds_mocks.objects.catalogue import CATALOGUE
from lsds_mocks.objects.height_map import height_map, read_heights
from pydantic import ValidationError

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext
from lsds.errors import DataError

PAD_X, PAD_Y = np.linspace(-12e-3, 12e-3, 97), np.linspace(-10e-3, 10e-3, 81)


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_object_can_be_pressed_and_presses_back(name):
    options = CellOptions(object=name)
    shape = build_surface(options, GelMaterial())
    gap = shape.gap(PAD_X[None, :], PAD_Y[:, None])
    assert np.isfinite(gap).all()
    assert (shape.least_gap(PAD_X[None, :], PAD_Y[:, None]) <= gap + 1e-9).all()
    gel = FieldGel(shape, fine=2)
    forces = [gel.press(depth) for depth in (0.1e-3, 0.2e-3, 0.4e-3)]
    assert 0 <= forces[0] < forces[1] < forces[2]
    assert forces[2] > 0.1
    assert options.kinetic_friction <= options.static_friction
    assert options.mass_kg == CATALOGUE[name].mass_kg


def test_the_catalogue_is_the_papers_fifteen_five_and_one():
    assert len(CATALOGUE) == 21
    assert {"pvc-pipe", "book", "scissors", "plank", "sponge", "duster"} < set(CATALOGUE)


def test_a_surface_is_the_objects_own_in_every_run():
    one, other = (build_surface(CellOptions(object="duster"), GelMaterial()) for _ in range(2))
    assert np.array_equal(one.gap(PAD_X[None, :], PAD_Y[:, None]), other.gap(PAD_X[None, :], PAD_Y[:, None]))


def test_little_of_a_sponge_touches():
    touched = {}
    for name in ("sponge", "cardboard-box"):
        gel = FieldGel(build_surface(CellOptions(object=name), GelMaterial()), fine=4)
        gel.press(0.1e-3)
        gel.trial(0.0, 0.0)
        gel.commit()
        touched[name] = gel.contact_fraction(gel.state(), 20e-3, 15e-3)
    assert touched["sponge"] < 0.75 * touched["cardboard-box"]


def test_what_is_set_beside_an_object_changes_it():
    options = CellOptions(object="plank", width_mm=5.0, edge_mm=2.0, length_mm=40.0)
    assert options.width_mm == 5.0
    assert options.diameter_mm == CATALOGUE["plank"].diameter_mm
    assert options.grip_height_mm == 20.0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"object": "spoon"}, "pvc-pipe"),
        ({"object": ["pvc-pipe"]}, "object"),
        ({"shape": "box", "width_mm": 12.0, "edge_mm": 8.0}, "edge_mm must not exceed half of width_mm"),
        ({"pad_width_mm": 100.0, "pad_thickness_mm": 4.0}, "pad_width_mm must be 1 to 10 times"),
        ({"kinetic_friction": 0.9}, "kinetic_friction must not exceed"),
        ({"grip_height_mm": 300.0}, "grip_height_mm must not exceed"),
    ],
)
def test_options_that_make_no_sense_are_refused_by_name(options, message):
    with pytest.raises(ValidationError, match=message):
        CellOptions(**options)


def test_a_height_map_lies_with_its_middle_at_the_objects_middle(tmp_path):
    size = 201
    y, x = np.mgrid[0:size, 0:size] - (size - 1) / 2
    np.save(tmp_path / "dome.npy", 1e-3 - (x**2 + (y - 30) ** 2) * (0.1e-3) ** 2 / (2 * 12e-3))
    dome = height_map(tmp_path / "dome.npy", mm_per_px=0.1)
    gap = dome.gap(PAD_X[None, :], PAD_Y[:, None])
    row, column = np.unravel_index(gap.argmin(), gap.shape)
    assert PAD_X[column] == pytest.approx(0.0, abs=0.2e-3)
    assert PAD_Y[row] == pytest.approx(3e-3, abs=0.3e-3)  # row 0 is at the smallest y
    near = np.hypot(PAD_X[None, :], PAD_Y[:, None] - 3e-3) < 5e-3
    exact = (PAD_X[None, :] ** 2 + (PAD_Y[:, None] - 3e-3) ** 2) / (2 * 12e-3)
    assert np.abs(gap - exact)[near].max() < 2e-6


def test_an_image_is_a_height_map(tmp_path):
    cv2.imwrite(str(tmp_path / "step.png"), np.repeat([[0, 255]], 4, axis=0).astype(np.uint8))
    heights = read_heights(tmp_path / "step.png", 0.5)
    assert heights == pytest.approx(np.repeat([[0.0, 0.5e-3]], 4, axis=0))


def bad_map(folder, how):
    path = folder / ("map.png" if how in ("colour", "text") else "map.tiff" if how == "float" else "map.npy")
    if how == "colour":
        cv2.imwrite(str(path), np.zeros((4, 4, 3), np.uint8))
    elif how == "float":
        cv2.imwrite(str(path), np.zeros((4, 4), np.float32))
    elif how == "text":
        path.write_text("no image")
    elif how == "no array":
        path.write_text("no array")
    elif how != "missing":
        content = {
            "nan": np.full((4, 4), np.nan),
            "one axis": np.zeros(4),
            "one row": np.zeros((1, 4)),
            "words": np.array([["a", "b"], ["c", "d"]]),
            "millimetres": np.array([[0.0, 100.0], [0.0, 0.0]]),
            "too long": np.zeros((2, 40_000), np.float32),
        }[how]
        np.save(path, content)
    return path


@pytest.mark.parametrize(
    "how",
    [
        "missing",
        "text",
        "colour",
        "float",
        "no array",
        "nan",
        "one axis",
        "one row",
        "words",
        "millimetres",
        "too long",
    ],
)
def test_a_bad_height_map_is_one_error_that_names_the_file(tmp_path, how):
    path = bad_map(tmp_path, how)
    with pytest.raises(DataError) as caught:
        build_cell(CellOptions(height_map=str(path), fidelity="pad", grid=1), BuildContext(VirtualClock(), 0))
    assert str(path) in str(caught.value)


def test_an_object_that_turns_slides_with_the_speed_of_its_patch():
    options = CellOptions(object="ruler", centre_x_mm=60.0, fidelity="pad", grid=1)
    plant = build_cell(options, BuildContext(VirtualClock(), 0)).plant
    plant.gel.press(0.2e-3)
    x, y = plant.gel.points_m
    plant.relative_rad_s = 0.7
    assert plant._sliding_speed() == pytest.approx(0.7 * np.sqrt(x.var() + y.var()))
    plant.relative_x_m_s, plant.relative_m_s = 3e-3, 4e-3
    assert plant._sliding_speed() > 5e-3
    assert plant.truth(0).relative_velocity_m_s == (3e-3, 4e-3)
