"""A fingertip driven by poses: force law, friction, frames, images and errors."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.fingertip.contact import Outline
from lsds_mocks.fingertip.fingertip import SimulatedFingertip
from lsds_mocks.fingertip.pose import Motion, Pose, motion_between
from lsds_mocks.objects.catalogue import CATALOGUE

from lsds.errors import DataError

DT_S = 2e-3
EVEN = {"fidelity": "winkler", "texture_amplitude": 0.0, "chatter_amplitude": 0.0}
PAD = Pose.of((0.0, 0.0, 0.0))


def fingertip(**options):
    return SimulatedFingertip(CellOptions(**{**EVEN, **options}))


def turned(angle_rad, axis):
    """Rotation matrix about a coordinate axis."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[a, a] = matrix[b, b] = math.cos(angle_rad)
    matrix[b, a] = math.sin(angle_rad)
    matrix[a, b] = -math.sin(angle_rad)
    return matrix


def at(depth_m, x_m=0.0, y_m=0.0, rotation=None, half_m=12.5e-3):
    return Pose.of((x_m, y_m, half_m - depth_m), rotation)


def settled(tip, pose, pad=PAD, steps=3):
    for _ in range(steps):
        wrench = tip.step(pad, pose, DT_S)
    return wrench


def slide(tip, depth_m, y_m, steps=60):
    for share in np.linspace(0.0, 1.0, steps):
        wrench = tip.step(PAD, at(depth_m, 0.0, share * y_m), DT_S)
    return wrench


@pytest.mark.parametrize("fidelity", ["winkler", "auto"])
def test_normal_force_rises_with_indentation_and_pushes_the_object_away(fidelity):
    tip = fingertip(fidelity=fidelity)
    forces = [settled(tip, at(depth))[2] for depth in np.linspace(0.1e-3, 0.7e-3, 7)]
    assert (np.diff(forces) > 0).all()
    assert forces[0] > 0


@pytest.mark.parametrize("fidelity", ["winkler", "auto"])
def test_tangential_force_rises_with_travel_up_to_friction_times_normal(fidelity):
    tip = fingertip(fidelity=fidelity)
    settled(tip, at(0.5e-3))
    forces = [-tip.step(PAD, at(0.5e-3, 0.0, y), DT_S)[1] for y in np.linspace(0.0, 2e-3, 400)]
    truth = tip.truth()
    assert truth.stick_ratio <= 0.1
    assert (np.diff(forces[:60]) > 0).all()
    # It slides at 2.5 mm/s, a quarter of the Stribeck speed.
    coefficient = 0.45 + 0.1 * math.exp(-(0.25**2))
    assert truth.tangential_force_n == pytest.approx(coefficient * truth.normal_force_n, rel=0.02)
    assert truth.slip_velocity_m_s == pytest.approx((0.0, 2e-3 / 399 / DT_S), rel=1e-6)


@pytest.mark.parametrize("name", CATALOGUE)
def test_both_forces_rise_with_the_load_for_every_object(name):
    tip = fingertip(object=name)
    half_m = CATALOGUE[name].diameter_mm * 0.5e-3
    normal = [settled(tip, at(depth, half_m=half_m))[2] for depth in np.linspace(0.1e-3, 0.5e-3, 9)]
    assert (np.diff(normal) > 0).all()
    shear = [-tip.step(PAD, at(0.5e-3, 0.0, y, half_m=half_m), DT_S)[1] for y in np.linspace(0.0, 0.1e-3, 30)]
    assert (np.diff(shear) > 0).all()


def test_the_object_is_pulled_back_and_the_wrench_turns_with_the_pad():
    """The same scene in a rotated world has the rotated wrench."""
    tip, other = fingertip(), fingertip()
    world = Pose.of((0.3, -0.2, 0.7), turned(0.8, 0) @ turned(-1.9, 2))
    for y in np.linspace(0.0, 0.3e-3, 20):
        pose = at(0.5e-3, 0.5 * y, y, turned(40 * y, 2))
        wrench = tip.step(PAD, pose, DT_S)
        moved = Pose.of(world.position_m + world.rotation @ pose.position_m, world.rotation @ pose.rotation)
        also = other.step(world, moved, DT_S)
    assert wrench[0] < 0
    assert wrench[1] < 0
    assert wrench[5] < 0
    assert also[:3] == pytest.approx(world.rotation @ wrench[:3], rel=1e-6)
    assert also[3:] == pytest.approx(world.rotation @ wrench[3:], rel=1e-6, abs=1e-12)


def test_a_round_object_is_felt_from_every_side():
    tip = fingertip()
    wanted = settled(fingertip(), at(0.5e-3))
    for angle in (0.0, 1.0, math.pi):
        assert settled(tip, at(0.5e-3, rotation=turned(angle, 1)), steps=1)[2] == pytest.approx(wanted[2], rel=1e-9)
        settled(tip, at(-1e-3))


def test_an_object_whose_end_covers_half_of_the_pad_presses_with_half_of_the_force():
    whole = settled(fingertip(), at(0.5e-3))[2]
    assert settled(fingertip(), at(0.5e-3, y_m=0.1))[2] == pytest.approx(0.5 * whole, rel=0.01)
    assert settled(fingertip(), at(0.5e-3, y_m=0.12)).tolist() == [0.0] * 6


def test_an_offset_sphere_is_pushed_at_its_contact():
    tip = fingertip(object="marble", fidelity="auto")
    wrench = settled(tip, at(0.6e-3, x_m=3e-3, half_m=12e-3))
    assert -wrench[4] / wrench[2] == pytest.approx(3e-3, abs=0.2e-3)
    assert wrench[3] / wrench[2] == pytest.approx(0.0, abs=0.1e-3)


@pytest.mark.parametrize("fidelity", ["winkler", "pad"])
@pytest.mark.parametrize("shape", ["sphere", "cylinder"])
def test_the_normal_force_of_a_round_object_is_no_torque_about_its_axis(fidelity, shape):
    """On bristles a ball 4 mm off the centre was turned by 1.9 mN m, and one that bounced gained energy."""
    tip = fingertip(fidelity=fidelity, shape=shape, diameter_mm=25)
    pose = at(0.3e-3, x_m=4e-3)
    wrench = settled(tip, pose)
    about_axis = wrench[3:] + np.cross(np.zeros(3) - pose.position_m, wrench[:3])
    assert wrench[2] > 0.1
    assert abs(about_axis[1]) < 0.06 * wrench[2] * 4e-3


def test_a_force_sets_the_indentation_that_carries_it():
    tip = fingertip()
    for force in (0.5, 1.0, 4.0):
        assert tip.step(PAD, at(0.0), DT_S, normal_n=force)[2] == pytest.approx(force, rel=0.01)
    assert tip.step(PAD, at(0.0), DT_S, normal_n=0.0).tolist() == [0.0] * 6


@pytest.mark.parametrize("fidelity", ["winkler", "auto"])
@pytest.mark.parametrize("shape", ["cylinder", "sphere", "box"])
def test_an_object_that_a_force_presses_shears_the_gel(fidelity, shape):
    """As one that is as deep does: looking for the depth of a force costs no shear."""
    options = {"shape": shape, "fidelity": fidelity, "texture_amplitude": 0.0}
    seen, felt = fingertip(**options), fingertip(**options)
    half_m = seen.options.diameter_mm * 0.5e-3
    for step in range(120):
        seen.step(PAD, Pose.of((0, step * 5e-6, half_m)), DT_S, normal_n=3.0)
        depth_m = seen.truth().indentation_m
        felt.step(PAD, Pose.of((0, step * 5e-6, half_m - depth_m)), DT_S)
    assert seen.truth().normal_force_n == pytest.approx(3.0, rel=0.01)
    assert seen.truth().tangential_force_n == pytest.approx(felt.truth().tangential_force_n, rel=0.05)
    assert seen.truth().tangential_force_n > 0.3


def test_an_object_behind_the_pad_does_not_touch_it():
    assert not fingertip().step(PAD, Pose.of((0, 0, -0.03)), DT_S).any()


def test_lost_contact_frees_the_gel():
    tip = fingertip()
    slide(tip, 0.5e-3, 0.3e-3)
    rest = tip.step(PAD, at(-1e-3), DT_S)
    assert rest.tolist() == [0.0] * 6
    assert (tip.truth().normal_force_n, tip.truth().tangential_force_n) == (0.0, 0.0)
    again = settled(tip, at(0.5e-3, 0.0, 5e-3), steps=1)
    assert again[:2].tolist() == pytest.approx([0.0, 0.0], abs=1e-9)
    assert again[2] > 0


def test_image_and_markers_move_with_the_object():
    tip = fingertip()
    settled(tip, at(0.5e-3))
    rest, before = tip.markers(), tip.image()
    slide(tip, 0.5e-3, 0.3e-3)
    moved = tip.markers() - rest
    assert before.shape == (240, 320, 3)
    assert before.dtype == np.uint8
    assert rest.shape == (63, 2)
    # The gel is computed for motion continued by one step, so its markers may be ahead by that.
    assert 4.0 < moved[:, 1].max() < 1.05 * 0.3 / 0.0625
    assert np.abs(tip.image().astype(int) - before).mean() > 1.0


def test_equal_seeds_give_equal_images_and_others_do_not():
    images = []
    for seed in (3, 3, 4):
        tip = SimulatedFingertip(CellOptions(**EVEN), seed=seed)
        settled(tip, at(0.5e-3))
        images.append(tip.image())
    assert (images[0] == images[1]).all()
    assert (images[0] != images[2]).any()


def test_a_tilted_object_is_reported_as_not_valid():
    tip = fingertip()
    settled(tip, at(0.5e-3, rotation=turned(math.radians(8), 0)))
    assert tip.truth().invalid == ()
    settled(tip, at(0.5e-3, rotation=turned(math.radians(12), 0)))
    assert tip.truth().tilt_rad == pytest.approx(math.radians(12))
    assert "tilted by 12 degrees" in tip.truth().invalid[0]


@pytest.mark.parametrize("fidelity", ["winkler", "pad"])
def test_a_place_that_bristles_ignore_is_reported_as_not_valid(fidelity):
    def reasons(**pose):
        tip = fingertip(fidelity=fidelity, shape="box", width_mm=10)
        settled(tip, at(0.3e-3, **pose))
        return " ".join(tip.truth().invalid)

    assert reasons(x_m=0.9e-3, rotation=turned(math.radians(9), 2)) == ""
    assert ("1.2 mm off the pad's centre" in reasons(x_m=1.2e-3)) == (fidelity == "winkler")
    assert ("turned by 12 degrees" in reasons(rotation=turned(math.radians(-12), 2))) == (fidelity == "winkler")
    # A flipped box has the same outline.
    assert reasons(rotation=turned(math.pi, 2)) == ""


@pytest.mark.parametrize(
    ("shape", "pose"),
    [
        ("cylinder", {"y_m": 2e-3}),
        ("sphere", {"rotation": turned(1.0, 2)}),
    ],
)
def test_a_place_that_changes_nothing_is_valid_on_bristles(shape, pose):
    """A long object may lie anywhere along its length, and a ball has no yaw."""
    tip = fingertip(shape=shape)
    settled(tip, at(0.3e-3, **pose))
    assert tip.truth().invalid == ()


def test_motion_is_that_of_the_material_at_the_pad():
    before = at(0.0)
    # Rolling about its axis moves a cylinder's surface by angle times radius.
    rolled = motion_between(before, at(0.0, rotation=turned(0.01, 1)))
    assert rolled == pytest.approx(Motion(-12.5e-3 * math.sin(0.01), 0.0, 0.0), abs=1e-9)
    assert motion_between(before, at(0.0, 1e-3, 2e-3, turned(0.1, 2))) == pytest.approx((1e-3, 2e-3, 0.1))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Pose.of((0, 0)), "pose: position has 2 values"),
        (lambda: Pose.of((0, 0, math.nan), name="left_pad"), "left_pad: a value is not finite"),
        (lambda: Pose.of((0, 0, 0), np.diag([1, 1, -1])), "not a rotation"),
        (lambda: Pose.of((0, 0, 0), 2 * np.eye(3)), "not a rotation"),
        (lambda: fingertip().step(PAD, at(0.0), 0.0), "time step is 0.0 s"),
        (lambda: fingertip().step(PAD, Pose.of((0, 0, -12e-3)), DT_S), "check that the pad.s z points to the object"),
        (lambda: fingertip().step(((0, 0, 0), np.eye(3)), at(0.0), DT_S), r"make them with Pose\.of"),
        (lambda: SimulatedFingertip("can"), r"pass ContactOptions\(object=\"can\"\)"),
        (lambda: fingertip().stable_step_s(0.0), "mass of a pad is 0.0 kg"),
        (lambda: SimulatedFingertip(seed=-1), "seed is -1; pass a whole number from 0 on"),
    ],
)
def test_bad_input_is_one_error_with_its_remedy(make, message):
    with pytest.raises(DataError, match=message):
        make()


@pytest.mark.parametrize("shape", ["cylinder", "box", "edge"])
def test_an_object_beside_the_pad_does_not_touch_it(shape):
    options = CellOptions(fidelity="winkler", shape=shape)
    pad, half_m = Pose.of([0, 0, 0]), options.diameter_mm * 0.5e-3
    near_m = 0.5e-3 * (options.width_mm if shape == "box" else options.diameter_mm)
    edge_m = near_m + 0.5e-3 * options.pad_width_mm

    if shape == "cylinder":  # Its part below the gel's surface counts.
        near_m = math.sqrt(half_m**2 - (half_m - 2e-4) ** 2)
        edge_m = near_m + 0.5e-3 * options.pad_width_mm

    def force_n(x_m):
        return SimulatedFingertip(options).step(pad, Pose.of([x_m, 0, half_m - 2e-4]), 1e-3)[2]

    assert force_n(0.0) > 0
    assert force_n(0.95 * edge_m) > 0
    assert force_n(1.05 * edge_m) == force_n(-1.05 * edge_m) == 0


@given(
    shape=st.sampled_from(["cylinder", "box", "edge", "sphere"]),
    towards=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: math.hypot(*v) > 0.1),
    angles=st.tuples(*[st.floats(-math.pi, math.pi)] * 3),
    beyond_m=st.floats(1e-4, 10.0),
)
def test_an_object_out_of_reach_carries_nothing_however_it_is_turned(shape, towards, angles, beyond_m):
    """A ball around the object that does not reach the pad is not pressed."""
    options = CellOptions(fidelity="winkler", shape=shape, diameter_mm=20, width_mm=60, length_mm=60, grip_height_mm=30)
    size_m = math.hypot(0.01, 0.03, 0.03) if shape == "box" else math.hypot(0.01, 0.03)
    pad_m = math.hypot(0.5e-3 * options.pad_width_mm, 0.5e-3 * options.pad_height_mm)
    place = (size_m + pad_m + beyond_m) * np.array(towards) / math.hypot(*towards)
    turn = turned(angles[0], 0) @ turned(angles[1], 1) @ turned(angles[2], 2)
    tip = SHARED.setdefault(shape, SimulatedFingertip(options))
    assert not tip.step(PAD, Pose.of(place, turn), DT_S).any()
    assert tip.truth().invalid == ()


SHARED = {}


@pytest.mark.parametrize(
    ("shape", "lies_m", "presses"),
    [("cylinder", 0.04, True), ("cylinder", 0.0435, False), ("box", 0.04, True), ("box", 0.0435, False)],
)
def test_an_object_that_lies_along_x_ends_where_it_ends(shape, lies_m, presses):
    # Half of its length is 30 mm, half of the pad's width 12.5 mm.
    options = CellOptions(fidelity="winkler", shape=shape, diameter_mm=20, length_mm=60, grip_height_mm=30)
    lying = Pose.of((lies_m, 0.0, 9.5e-3), [0, -1, 0, 1, 0, 0, 0, 0, 1])
    assert SimulatedFingertip(options).step(PAD, lying, DT_S).any() == presses


def test_an_object_on_its_edge_carries_nothing_and_is_not_valid():
    options = CellOptions(fidelity="winkler", shape="box", diameter_mm=20, width_mm=60, length_mm=60, grip_height_mm=30)
    carries = {}
    for degrees in (44, 46, 90):
        tip, lean = SimulatedFingertip(options), turned(math.radians(degrees), 0)
        # The middle of the face that is turned to the pad lies half a millimetre deep over its centre.
        face = lean @ np.array([0.0, 0.0, -0.01])
        carries[degrees] = tip.step(PAD, Pose.of(-face - np.array([0.0, 0.0, 5e-4]), lean), DT_S).any()
        assert ("beyond a tilt of 45 degrees the pad carries nothing" in tip.truth().invalid) == (degrees > 45)
    assert carries == {44: True, 46: False, 90: False}


@given(
    shape=st.sampled_from(["cylinder", "box", "edge"]),
    x_m=st.floats(-0.06, 0.06),
    y_m=st.floats(-0.06, 0.06),
    yaw=st.floats(-math.pi, math.pi),
    tilt=st.floats(-0.7, 0.7),
)
def test_what_touches_covers_a_part_of_the_pad(shape, x_m, y_m, yaw, tilt):
    outline = Outline(shape, 0.01, 0.03, 0.03, 0.03 if shape == "box" else 0.01)
    touch = outline.touch(Pose.of((x_m, y_m, 9e-3), turned(yaw, 2) @ turned(tilt, 0)), (0.025, 0.02))
    if touch is not None and touch.reach_m is not None:
        assert -0.01 <= touch.reach_m[0] < touch.reach_m[1] <= 0.01


@pytest.mark.parametrize(
    ("shape", "at_m", "indentation_m", "reach_m", "tilt_rad"),
    [
        ("cylinder", (0.002, -0.03), -0.005226110182761238, (-0.01, 0.009349695153154845), 0.2),
        ("cylinder", (0.012, 0.001), 0.00017818580401510447, None, 0.2),
        ("box", (0.002, -0.03), -0.0044628659858041795, (-0.01, 0.009045185336447749), 0.22330745949001382),
        ("box", (0.012, 0.001), -0.0009744728469164958, None, 0.22330745949001382),
        ("edge", (0.002, -0.03), -0.005277084625058597, (-0.01, 0.009045185336447749), 0.22330745949001382),
        ("edge", (0.012, 0.001), 0.0001272113617177429, None, 0.22330745949001382),
    ],
)
def test_a_touch_is_that_of_array_arithmetic(shape, at_m, indentation_m, reach_m, tilt_rad):
    """The expected values are those of NumPy's vectors, which the written-out ones replace."""
    outline = Outline(shape, 0.01, 0.03, 0.04, 0.02 if shape == "box" else 0.01)
    rotation = turned(0.3, 2) @ turned(0.2, 0) @ turned(0.1, 1)
    touch = outline.touch(Pose.of((*at_m, 9.5e-3), rotation), (0.025, 0.02))
    assert touch.indentation_m == pytest.approx(indentation_m, rel=0, abs=1e-12)
    assert touch.reach_m == (reach_m and pytest.approx(reach_m, rel=0, abs=1e-12))
    assert touch.tilt_rad == pytest.approx(tilt_rad, rel=0, abs=1e-12)
    rolls = (math.cos(0.3), math.sin(0.3)) if shape == "cylinder" else (0.0, 0.0)
    assert touch.rolls == pytest.approx(rolls, rel=0, abs=1e-12)


@pytest.mark.parametrize("degrees", [0, 5, 10, 20])
def test_a_tilted_cylinder_is_as_deep_as_its_surface(degrees):
    """A straight line along z through the pad's centre leaves the cylinder at its axis' height less r / cos(tilt)."""
    lean = math.radians(degrees)
    outline = Outline("cylinder", 0.012, 0.05, 0.05, 0.012)
    touch = outline.touch(Pose.of((0, 0, 0.0119), turned(lean, 0)), (0.025, 0.02))
    assert touch.indentation_m == pytest.approx(0.012 / math.cos(lean) - 0.0119)
    assert touch.tilt_rad == pytest.approx(lean)


@pytest.mark.parametrize("shape", ["sphere", "cylinder"])
def test_an_object_that_has_rolled_turns_about_its_own_contact(shape):
    """It is neither sheared nor does it slip, as if it had not rolled."""
    tip = fingertip(shape=shape, diameter_mm=20, length_mm=20, grip_height_mm=10)
    for angle in np.linspace(0.0, 0.3, 100):
        tip.step(PAD, at(3e-4, x_m=0.01 * angle, rotation=turned(angle, 1), half_m=0.01), DT_S)
    before = tip.truth()
    for yaw in np.linspace(0.0, 0.3 if shape == "sphere" else 0.02, 100):
        turn = turned(yaw, 2) @ turned(0.3, 1)
        tip.step(PAD, at(3e-4, x_m=3e-3, rotation=turn, half_m=0.01), DT_S)
    assert tip.truth().slip_distance_m == before.slip_distance_m == 0.0
    assert tip.truth().tangential_force_n < before.tangential_force_n + 0.02


def test_a_ball_whose_contact_leaves_the_pad_is_not_carried():
    tip = fingertip(shape="sphere", diameter_mm=20, length_mm=20, grip_height_mm=10)
    carried = [
        tip.step(PAD, at(3e-4, x_m=0.01 * angle, rotation=turned(angle, 1), half_m=0.01), DT_S)[2] > 0
        for angle in np.linspace(0.0, 2.0, 400)
    ]
    # Half of the pad's width is 12.5 mm, and the ball's cap below the gel's surface 2.4 mm wide.
    assert carried.index(False) * 2.0 / 399 * 10 == pytest.approx(12.5 + 2.4, abs=0.2)


@pytest.mark.parametrize("bad", [{"normal_n": math.nan}, {"target": [0.0, 0.0, math.nan]}])
def test_values_that_are_not_finite_are_one_error(bad):
    tip = SimulatedFingertip(CellOptions(fidelity="winkler"))
    target = Pose(np.array(bad.pop("target", [0.0, 0.0, 0.0124])), np.eye(3))
    with pytest.raises(DataError, match=r"fingertip: .*check whether the scene's simulation diverged"):
        tip.step(Pose.of([0, 0, 0]), target, 1e-3, **bad)


def test_a_new_trial_forgets_slip_and_what_made_results_invalid():
    tip = SimulatedFingertip(CellOptions(fidelity="winkler"))
    pad = Pose.of([0, 0, 0])
    for k in range(20):
        tip.step(pad, Pose.of([0, 1e-3 * k, 0.5e-3 * tip.options.diameter_mm - 1.5e-3]), 1e-3)
    assert tip.truth().invalid
    assert tip.truth().slip_distance_m > 0
    tip.restart()
    truth = tip.truth()
    assert (truth.time_s, truth.slip_distance_m, truth.invalid) == (0.0, 0.0, ())


@pytest.mark.parametrize("fidelity", ["winkler", "auto"])
def test_the_force_of_a_motion_does_not_depend_on_how_the_time_steps_change(fidelity):
    """A longer step left a lasting false shear: the lead of the step before was taken back at its length."""
    forces = []
    for moving_s, resting_s in ((1e-3, 1e-3), (5e-4, 2e-3)):
        tip = fingertip(fidelity=fidelity)
        for y_um in (0, 0, 0, 0, 0, 5, 10, 15, 20):
            tip.step(PAD, at(5e-4, y_m=1e-6 * y_um), moving_s)
        for _ in range(20):
            wrench = tip.step(PAD, at(5e-4, y_m=2e-5), resting_s)
        forces.append(wrench[1])
    assert forces[0] < -0.01
    assert forces[1] == pytest.approx(forces[0], rel=0.02)


def test_a_slide_along_y_alone_has_the_torque_of_its_shear():
    tip = SimulatedFingertip(CellOptions(object="sponge", fidelity="winkler", texture_amplitude=0.08), seed=1)
    for k in range(400):
        tip.step(PAD, at(4e-4, y_m=2e-6 * k, half_m=tip._outline.half_m), 1e-3)
    state, (x, y) = tip.gel.state(), tip.gel.points_m
    own_nm = float(x @ state.shear_n[1] - y @ state.shear_n[0])
    assert abs(own_nm) > 1e-4
    assert abs(tip.truth().torque_nm) == pytest.approx(abs(own_nm), rel=0.05)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (lambda tip: tip.stable_step_s(0.5, 0.0), "mass of an object is 0"),
        (lambda tip: tip.stable_step_s(0.5, -1.0), "mass of an object is -1"),
        (lambda tip: tip.stable_step_s("1"), "mass of a pad is '1'"),
        (lambda tip: tip.step(PAD, at(1e-4), "0.002"), "time step is '0.002' s"),
        (lambda tip: tip.step(PAD, at(1e-4), DT_S, normal_n="5"), "normal force is '5' N"),
        (lambda tip: tip.step(PAD, Pose(np.zeros(2), np.eye(3)), DT_S), r"position has the shape \(2,\)"),
        (lambda tip: tip.step(PAD, Pose(at(1e-4).position_m, 2 * np.eye(3)), DT_S), "is not a rotation"),
        (lambda tip: Pose.of("abc"), "not made of numbers"),
        (lambda tip: tip.step(PAD, Pose(np.array([0, 0, None]), np.eye(3)), DT_S), "not made of numbers"),
        (lambda tip: SimulatedFingertip(seed=True), "seed is True; pass a whole number"),
        (lambda tip: SimulatedFingertip(seed=1.5), "seed is 1.5; pass a whole number"),
        (lambda tip: tip.step(PAD, Pose([0, 0, 0.01], [[1, 0, 0], [0, 1, 0], [0, 0, 1]]), DT_S), "are no arrays"),
        (lambda tip: SimulatedFingertip(None, {"gel": 7}), "look is"),
    ],
)
def test_what_is_no_mass_step_pose_or_look_is_named(asked, message):
    with pytest.raises(DataError, match=message):
        asked(fingertip())
