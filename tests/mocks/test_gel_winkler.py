import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_mocks.gel.shapes import Box, Cylinder, Sphere
from lsds_mocks.gel.winkler import WinklerGel

MU = 0.6
PIPE = Cylinder(12.5e-3, 20.16e-3)


def pressed(shape=PIPE, depth=0.3e-3, mu=MU, **options):
    gel = WinklerGel(shape, **options)
    gel.press(depth)
    gel.set_friction(np.full(gel.points_m.shape[1], mu))
    return gel


def drag(gel, dx=0.0, dy=0.0, dtheta=0.0, steps=1):
    for _ in range(steps):
        reaction = gel.trial(dx / steps, dy / steps, dtheta / steps)
        gel.commit()
    return reaction


@pytest.mark.parametrize(
    ("shape", "depth", "force", "tolerance"),
    [
        (Sphere(12e-3), 0.4e-3, 0.681, 0.03),
        (Cylinder(12.5e-3, 20.16e-3 / np.cos(0.35), 0.35), 0.3e-3, 2.678, 0.03),
        (Box(10e-3, 10e-3), 0.15e-3, 1.978, 0.15),
    ],
)
def test_normal_force_agrees_with_the_finite_pad_reference(shape, depth, force, tolerance):
    assert WinklerGel(shape).normal_force(depth) == pytest.approx(force, rel=tolerance)


@pytest.mark.parametrize(
    ("shape", "depth", "stiffness", "tolerance"),
    [
        (Sphere(12e-3), 0.4e-3, 1.26e3, 0.1),
        (Cylinder(12.5e-3, 20.16e-3 / np.cos(0.35), 0.35), 0.3e-3, 3.58e3, 0.1),
        (Box(10e-3, 10e-3), 0.15e-3, 3.2e3, 0.15),
    ],
)
def test_shear_stiffness_agrees_with_the_finite_pad_reference(shape, depth, stiffness, tolerance):
    gel = pressed(shape, depth, design_m=depth, mu=10.0)
    assert gel.trial(1e-5, 0.0).force_x_n / 1e-5 == pytest.approx(stiffness, rel=tolerance)


def test_pressure_adds_up_to_the_normal_force_and_falls_toward_the_edge():
    gel = pressed()
    pressure = gel.state().pressure_n
    assert pressure.sum() == pytest.approx(gel.normal_force(0.3e-3))
    across = np.abs(gel.points_m[0])
    inside = pressure > 0
    order = np.argsort(across[inside], kind="stable")
    assert (np.diff(pressure[inside][order]) <= 1e-12).all()


motions = st.lists(
    st.tuples(st.floats(-4e-4, 4e-4), st.floats(-4e-4, 4e-4), st.floats(-0.05, 0.05), st.floats(0.02e-3, 0.8e-3)),
    min_size=1,
    max_size=12,
)


@given(motions)
def test_coulomb_limit_holds_at_every_point_and_in_sum(path):
    gel = pressed()
    for dx, dy, dtheta, depth in path:
        force = gel.normal_force(depth)
        gel.press(depth)
        gel.set_friction(np.full(gel.points_m.shape[1], MU))
        reaction = drag(gel, dx, dy, dtheta)
        state = gel.state()
        shear = np.hypot(*state.shear_n)
        assert (shear <= MU * state.pressure_n * (1 + 1e-9) + 1e-15).all()
        assert np.hypot(reaction.force_x_n, reaction.force_y_n) <= MU * force * (1 + 1e-9)


@given(st.floats(1e-4, 3e-3), st.floats(0, 2 * np.pi))
def test_full_slip_stays_on_the_limit_without_creeping_below(length, angle):
    gel = pressed()
    drag(gel, 2e-3 * np.cos(angle), 2e-3 * np.sin(angle), steps=20)
    assert gel.fully_sliding
    for _ in range(5):
        reaction = drag(gel, length * np.cos(angle), length * np.sin(angle))
        assert np.hypot(reaction.force_x_n, reaction.force_y_n) == pytest.approx(MU * gel.normal_force(0.3e-3))


def test_stick_then_partial_slip_from_the_edges_then_full_slip():
    gel = pressed()
    ratios, edge_first = [], True
    across = np.abs(gel.points_m[0])
    for _ in range(60):
        drag(gel, dy=1e-5)
        ratios.append(gel.stick_ratio)
        touching = gel.state().pressure_n > 0
        slid = gel.sliding & touching
        if slid.any() and not slid[touching].all():
            edge_first &= across[slid].min() > across[touching & ~gel.sliding].max() - 1e-9
    assert ratios[0] == 1.0
    assert ratios[-1] == 0.0
    assert (np.diff(ratios) <= 0).all()
    assert sum(0 < r < 1 for r in ratios) > 10
    assert edge_first


def test_reversal_shows_hysteresis():
    gel = pressed()
    forward = [drag(gel, dy=2e-5).force_y_n for _ in range(20)]
    back = [drag(gel, dy=-2e-5).force_y_n for _ in range(20)]
    assert back[-1] < -0.02 * forward[-1]
    assert gel.elastic_energy_j > 0


def test_a_small_circle_within_stick_leaves_no_trace():
    gel = pressed()
    limit = 1e-6
    for angle in np.linspace(0, 2 * np.pi, 9)[1:]:
        drag(gel, limit * np.cos(angle), limit * np.sin(angle))
    inner = gel.state().pressure_n > 0.5 * gel.state().pressure_n.max()
    assert np.abs(gel.state().deflection_m[:, inner]).max() < 1e-12


def test_a_micrometre_moves_the_dots():
    gel = pressed()
    xy = np.array([[0.0, 0.0], [6e-3, 0.0]])
    before = gel.marker_displacement(gel.state(), xy)
    drag(gel, dy=1e-6)
    moved = gel.marker_displacement(gel.state(), xy) - before
    assert moved[0, 1] == pytest.approx(1e-6, rel=0.1)
    assert 0.05e-6 < moved[1, 1] < 0.7 * moved[0, 1]


def test_a_press_spreads_the_dots():
    gel = pressed(Sphere(12e-3), 0.4e-3, design_m=0.4e-3)
    xy = np.array([[4e-3, 0.0], [-4e-3, 0.0], [0.0, 4e-3], [0.0, 0.0]])
    u = gel.marker_displacement(gel.state(), xy)
    outward = np.array([u[0, 0], -u[1, 0], u[2, 1]])
    assert outward == pytest.approx([38e-6] * 3, rel=0.2)
    assert np.abs(u[3]).max() < 1e-9


def test_torsion_turns_the_dots_and_is_limited():
    gel = pressed(Sphere(12e-3), 0.4e-3, design_m=0.4e-3)
    xy = np.array([[1.5e-3, 0.0]])
    first = drag(gel, dtheta=0.03)
    assert gel.marker_displacement(gel.state(), xy)[0, 1] > 10e-6
    last = drag(gel, dtheta=0.6, steps=20)
    assert first.torque_nm < last.torque_nm < MU * gel.normal_force(0.4e-3) * 2.8e-3
    assert last.torque_nm * 1e3 == pytest.approx(0.644, rel=0.3)


def test_trials_leave_no_trace_and_history_can_be_put_back():
    gel = pressed()
    drag(gel, dy=1e-4)
    kept = gel.state()
    alone = gel.trial(0.0, 5e-5)
    gel.trial(3e-4, -2e-3, 0.1)
    assert gel.trial(0.0, 5e-5) == alone
    drag(gel, dy=1e-3)
    gel.press(0.5e-3)
    gel.restore(kept)
    gel.set_friction(np.full(gel.points_m.shape[1], MU))
    assert gel.trial(0.0, 5e-5) == alone


def test_depth_map_follows_the_object_in_contact_and_is_flat_far_away():
    gel = pressed()
    x, y = np.linspace(-10e-3, 10e-3, 81), np.linspace(-7e-3, 7e-3, 41)
    depth = gel.depth(gel.state(), x, y)
    assert depth.max() == pytest.approx(0.3e-3, rel=0.02)
    middle = np.abs(x) < 1.5e-3
    assert depth[20, middle] == pytest.approx(0.3e-3 - x[middle] ** 2 / 25e-3, rel=0.03)
    assert depth[:, np.abs(x) > 8e-3].max() < 1e-6
    assert gel.contact_fraction(gel.state(), 20e-3, 15e-3) == pytest.approx(2 * 2.525 / 20, rel=0.03)
