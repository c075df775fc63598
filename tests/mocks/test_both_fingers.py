"""The right finger's image mirrors the left finger's gel (markers, depth, rotation), but not the lamps."""

import numpy as np
import pytest
from lsds_mocks.cell.build import build_cell
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.devices.gelsight import MockGelSightMini
from lsds_mocks.devices.gelsight_options import GelSightOptions
from lsds_mocks.optics.pad import CENTRE_PX
from mock_rig import MS

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext

ALIKE = {"gel_variation": 0.0, "noise": 0.0, "drift": 0.0, "dim_start": False, "jitter_ms": 0.0}
"""Two sensors with these options differ in nothing but the finger."""
ROWS, COLUMNS = 7, 9


class Hand:
    """A cell with a sensor on each finger named; its plant is moved by hand, without gripper and arm."""

    def __init__(self, *fingers, cell=None, sensor=ALIKE):
        self.clock = VirtualClock()
        context = BuildContext(self.clock, 5)
        self.cell = build_cell(
            CellOptions(**{"fidelity": "pad", "grid": 1, "vibration_um": 0.0, **(cell or {})}), context
        )
        self.sensors = [MockGelSightMini(GelSightOptions(finger=finger, **sensor), context) for finger in fingers]
        for sensor in self.sensors:
            sensor.connect()

    def grasp_and_lift(self, aperture_mm, until_ms=560, speed_m_s=0.03):
        fingers = self.cell.plant.fingers
        fingers.aperture_m = fingers.target_m = aperture_mm * 1e-3
        self.cell.plant.arm.target_m_s = speed_m_s
        self.clock.sleep_until(until_ms * MS)
        return [sensor.read() for sensor in self.sensors]


def as_grid(truth):
    """Return rest places and displacements (rows, columns, 2) in px from the image's centre."""
    moved = truth.xy_px - truth.rest_px
    return (truth.rest_px - CENTRE_PX).reshape(ROWS, COLUMNS, 2), moved.reshape(ROWS, COLUMNS, 2)


def mirrored(grid):
    return grid[:, ::-1] * (-1, 1)


@pytest.mark.parametrize("fidelity", ["pad", "winkler"])
def test_displacements_are_mirrored_under_load_slip_and_turning(fidelity):
    hand = Hand("left", "right", cell={"fidelity": fidelity, "centre_x_mm": 12.0})
    hand.grasp_and_lift(23.2)
    truth = hand.cell.truth()
    assert truth.slip_distance_m > 1e-4
    assert abs(hand.cell.plant.body.place.angle_rad) > 0.01
    left, right = (sensor.marker_truth() for sensor in hand.sensors)
    (rest, moved), (rest_right, moved_right) = as_grid(left), as_grid(right)
    assert rest_right == pytest.approx(mirrored(rest), abs=1e-9)
    assert np.abs(moved).max() > 3
    assert np.abs(moved - moved_right).max() > 1
    assert moved_right == pytest.approx(mirrored(moved), abs=1e-4)
    assert left.contact_fraction == right.contact_fraction > 0


def test_the_right_finger_sees_what_the_left_one_sees_of_the_mirrored_cell():
    """The plant's own symmetry: a weight to the right on one finger is a weight to the left on the other."""
    seen = []
    for finger, centre_mm in (("left", 12.0), ("right", -12.0)):
        hand = Hand(finger, cell={"fidelity": "winkler", "centre_x_mm": centre_mm, "texture_amplitude": 0.0})
        hand.grasp_and_lift(23.2)
        seen.append(as_grid(hand.sensors[0].marker_truth())[1])
    assert np.abs(seen[0]).max() > 3
    assert np.abs(seen[0] - seen[1]).max() < 1e-3


@pytest.mark.parametrize("optics", ["linear", "full"])
def test_a_relief_is_mirrored_and_the_lamps_are_not(tmp_path, optics):
    y, x = np.mgrid[0:201, 0:201] - 100
    images = {}
    for finger, side in (("left", 1), ("right", 1), ("left", -1)):
        path = tmp_path / f"bump{side}.npy"
        np.save(path, 1e-3 - ((x - 40 * side) ** 2 + (y - 15) ** 2) * (0.1e-3) ** 2 / (2 * 12e-3))
        hand = Hand(finger, cell={"height_map": str(path)}, sensor=ALIKE | {"optics": optics})
        (frame,) = hand.grasp_and_lift(24.0, until_ms=250, speed_m_s=0.0)
        images[finger, side] = frame.image.astype(int)
    of_mirrored = np.abs(images["right", 1] - images["left", -1])
    assert of_mirrored.max() <= 2
    assert np.abs(images["right", 1] - images["left", 1]).max() > 10
    flipped = images["left", 1][:, ::-1]
    assert np.abs(images["right", 1] - flipped).max() > 10


def test_noise_prints_and_exposures_are_each_sensors_own():
    hand = Hand("left", "right", sensor={})
    left, right = hand.grasp_and_lift(50.0, until_ms=400, speed_m_s=0.0)
    assert left.t_ns != right.t_ns
    difference = left.image.astype(int) - right.image[:, ::-1]
    assert difference.std() > 1
    a, b = (as_grid(sensor.marker_truth())[0] for sensor in hand.sensors)
    assert np.abs(a - mirrored(b)).max() > 0.1


@pytest.mark.parametrize("fidelity", ["auto", "winkler"])
def test_a_second_sensor_changes_nothing_for_the_first(fidelity):
    cell = {"fidelity": fidelity}
    alone, both = Hand("left", cell=cell, sensor={}), Hand("right", "left", cell=cell, sensor={})
    for until_ms in (300, 420, 560):
        (expected,), (_, found) = alone.grasp_and_lift(23.4, until_ms), both.grasp_and_lift(23.4, until_ms)
        assert (expected.t_ns, expected.seq) == (found.t_ns, found.seq)
        assert np.array_equal(expected.image, found.image)
        assert alone.cell.truth() == both.cell.truth()
