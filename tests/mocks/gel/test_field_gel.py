"""Laws that the elastic gels keep on any path: Coulomb, no tension, no energy from nowhere, no clock."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lsds_mocks.gel.field.choice import SWEEPS
from lsds_mocks.gel.field.gel import FieldGel
from lsds_mocks.gel.material import GelMaterial
from lsds_mocks.gel.shapes import Box, Cylinder, Sphere
from lsds_mocks.gel.shapes import Box as ShapeBox
from lsds_mocks.gel.state import blend

SHAPES = {
    "sphere": Sphere(10e-3),
    "cylinder": Cylinder(12.5e-3, 20.16e-3, 0.35),
    "edge": Cylinder(1.5e-3, 20.16e-3, -0.2),
    "block": Box(8e-3, 6e-3, 0.5e-3, 0.3),
}
legs = st.lists(
    st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1), st.floats(-0.3, 0.5), st.integers(1, 12)),
    min_size=1,
    max_size=4,
)


def make(shape, *, friction=0.6, depth=0.3e-3, steps=5, **options):
    gel = FieldGel(SHAPES[shape], **options)
    for at in np.linspace(depth / steps, depth, steps):
        press(gel, at, friction)
        gel.trial(0.0, 0.0)
        gel.commit()
    return gel


def press(gel, depth, friction):
    gel.press(depth)
    gel.set_friction(np.full(gel.points_m.shape[1], friction))


@settings(max_examples=40)
@given(
    shape=st.sampled_from(sorted(SHAPES)),
    friction=st.floats(0.3, 2.5),
    poisson=st.floats(0.30, 0.499),
    step=st.floats(-6.5, -4.1).map(lambda e: 10**e),
    path=legs,
    follows=st.booleans(),
)
def test_laws_hold_on_any_path(shape, friction, poisson, step, path, follows):
    gel = FieldGel(SHAPES[shape], GelMaterial(poisson=poisson), fine=1, kernel="layer", follows=follows)
    depth = energy = most = given = 0.0
    for dx, dy, turn, pressing, count in [(0, 0, 0, 0.05e-3 / step, 5), *path]:
        for _ in range(count):
            deeper = min(max(depth + pressing * step, 1e-5), 0.5e-3)
            press(gel, deeper, friction)
            motion = (dx * step, dy * step, turn * step / 10e-3)
            reaction = gel.trial(*motion)
            gel.commit()
            work = reaction.normal_n * (deeper - depth) + reaction.force_x_n * motion[0]
            work += reaction.force_y_n * motion[1] + reaction.torque_nm * motion[2]
            depth, before, energy = deeper, energy, gel.elastic_energy_j
            most = max(most, energy)
            state = gel.state()
            assert np.isfinite(energy)
            assert (state.pressure_n >= 0).all()
            limit = friction * state.pressure_n
            assert (np.hypot(*state.shear_n) <= limit * (1 + 1e-4) + 1e-6 * limit.max(initial=0)).all()
            # Up to what the sweeps leave of the stored energy, in a step and in all steps so far.
            assert energy - before - work <= gel.tolerance * most
            given += work
            assert energy - given <= gel.tolerance * most
    assert gel.effort.unconverged == 0


@pytest.mark.parametrize("shape", sorted(SHAPES))
def test_settles_in_few_sweeps_under_high_friction(shape):
    for friction in (0.3, 1.0, 2.5):
        gel = make(shape, friction=friction, fine=2)
        for motion in [(40e-6, 30e-6, 0.002)] * 20 + [(-50e-6, 0.0, 0.0)] * 10:
            before = gel.effort.sweeps
            gel.trial(*motion)
            gel.commit()
            assert gel.effort.sweeps - before < SWEEPS
        assert gel.effort.unconverged == 0


@pytest.mark.parametrize("shape", sorted(SHAPES))
@pytest.mark.parametrize("parts", [2, 7, 20])
def test_a_motion_in_small_steps_ends_where_it_ends_in_one(shape, parts):
    """The rate at which a path is gone along does not matter, turns and reversals included."""
    xy = np.stack(np.meshgrid(np.linspace(-8e-3, 8e-3, 9), np.linspace(-6e-3, 6e-3, 7)), -1).reshape(-1, 2)
    path = [(50e-6, 0, 0)] * 6 + [(0, 50e-6, 0.002)] * 5 + [(-40e-6, -20e-6, 0)] * 6
    ends = []
    for n in (1, parts):
        gel = make(shape, fine=1)
        places = []
        for motion in path:
            for _ in range(n):
                reaction = gel.trial(*(m / n for m in motion))
                gel.commit()
            places.append(gel.marker_displacement(gel.state(), xy))
        ends.append((np.array(places), reaction))
    (one, force), (many, forces) = ends
    moved = np.sqrt((one**2).sum(-1).mean())
    assert np.sqrt(((one - many) ** 2).sum(-1).mean()) <= max(0.02 * moved, 1e-6)
    assert forces.normal_n == pytest.approx(force.normal_n, rel=0.02)
    limit = 0.02 * 0.6 * force.normal_n
    assert forces.force_x_n == pytest.approx(force.force_x_n, abs=limit)
    assert forces.force_y_n == pytest.approx(force.force_y_n, abs=limit)


def test_creep_far_below_what_the_solver_resolves_adds_up():
    gel = make("sphere", fine=2)
    for _ in range(4000):
        gel.trial(0.0, 5e-9)
        gel.commit()
    other = make("sphere", fine=2)
    reaction = other.trial(0.0, 20e-6)
    other.commit()
    assert gel.trial(0.0, 0.0).force_y_n == pytest.approx(reaction.force_y_n, rel=0.02)


def test_trembling_does_not_walk():
    gel = make("sphere", fine=2)
    gel.trial(0.0, 60e-6)
    gel.commit()
    force = gel.trial(0.0, 0.0).force_y_n
    for k in range(3000):
        gel.trial(0.0, 0.5e-6 * (-1) ** k)
        gel.commit()
    assert gel.trial(0.0, 0.0).force_y_n == pytest.approx(force, rel=0.02)


def test_a_micrometre_moves_the_dots():
    gel = FieldGel(SHAPES["sphere"], tolerance=1e-3)
    press(gel, 0.3e-3, 0.6)
    gel.trial(0.0, 0.0)
    gel.commit()
    xy = np.zeros((1, 2))
    before = gel.marker_displacement(gel.state(), xy)
    gel.trial(1e-6, 0.0)
    gel.commit()
    assert gel.marker_displacement(gel.state(), xy)[0, 0] - before[0, 0] == pytest.approx(1e-6, rel=0.1)


def test_reversal_shows_hysteresis():
    gel = make("sphere")
    there = [gel.trial(20e-6, 0.0).force_x_n for _ in range(10) if gel.commit() is None]
    back = [gel.trial(-20e-6, 0.0).force_x_n for _ in range(10) if gel.commit() is None]
    assert there[-1] > 0
    assert back[-1] < -0.1 * there[-1]


def test_trials_leave_no_trace():
    gel, other = make("cylinder"), make("cylinder")
    for motion in [(30e-6, 0.0), (0.0, 90e-6), (-70e-6, 10e-6)]:
        gel.trial(*motion)
    for each in (gel, other):
        reaction = each.trial(25e-6, 10e-6)
        each.commit()
        each.force = [reaction.force_x_n, reaction.force_y_n, reaction.normal_n]
    assert gel.force == pytest.approx(other.force, abs=2e-3 * other.force[2])


def test_state_can_be_put_back():
    gel = make("sphere")
    for _ in range(5):
        gel.trial(40e-6, 10e-6)
        gel.commit()
    state = gel.state()
    xy = gel.points_m.T[::7].copy()
    there = gel.marker_displacement(state, xy)
    on = [gel.trial(-30e-6, 0.0).force_x_n for _ in range(4) if gel.commit() is None]
    other = FieldGel(SHAPES["sphere"])
    other.restore(state)
    other.set_friction(np.full(other.points_m.shape[1], 0.6))
    assert other.marker_displacement(other.state(), xy) == pytest.approx(there, abs=1e-9)
    again = [other.trial(-30e-6, 0.0).force_x_n for _ in range(4) if other.commit() is None]
    assert again == pytest.approx(on, abs=0.01 * max(map(abs, on)) + 2e-3)


def test_a_dent_travels_with_a_sphere_that_is_dragged_along():
    gel = make("sphere", friction=0.4)
    for _ in range(60):
        gel.trial(60e-6, 0.0)
        gel.commit()
    state = gel.state()
    x = float(gel.points_m[0] @ state.pressure_n / state.pressure_n.sum())
    assert x == pytest.approx(3.6e-3, rel=0.1)
    assert gel.fully_sliding
    depth = gel.depth(state, np.linspace(-8e-3, 8e-3, 65), np.linspace(-6e-3, 6e-3, 49))
    assert np.abs(np.linspace(-8e-3, 8e-3, 65)[depth.max(axis=0).argmax()] - 3.6e-3) < 0.5e-3
    assert depth.max() == pytest.approx(0.3e-3, rel=0.05)


def test_letting_go_leaves_nothing():
    gel = make("sphere")
    gel.press(0.0)
    gel.trial(0.0, 0.0)
    gel.commit()
    state = gel.state()
    assert state.pressure_n.sum() == 0
    assert not state.shear_n.any()
    assert gel.elastic_energy_j == 0
    assert gel.stick_ratio == 1


def test_states_blend_over_cells_that_came_and_went():
    gel = make("sphere", depth=0.15e-3)
    early = gel.state()
    press(gel, 0.25e-3, 0.6)
    gel.trial(0.0, 0.0)
    gel.commit()
    late = gel.state()
    assert len(late.cells) > len(early.cells)
    middle = blend(early, late, 0.5)
    assert middle.pressure_n.sum() == pytest.approx((early.pressure_n.sum() + late.pressure_n.sum()) / 2)
    assert middle.indentation_m == pytest.approx(0.2e-3)


def test_a_trial_that_is_not_kept_leaves_no_surface_behind():
    found = []
    for tried in ((), ((6e-3, 0.0),)):
        gel = FieldGel(ShapeBox(28e-3, 24e-3), fine=1)
        press(gel, 0.1e-3, 0.6)
        for motion in (*tried, (1e-6, 0.0)):
            gel.trial(*motion)
        gel.commit()
        found.append(float(gel.state().pressure_n.sum()))
    assert found[1] == pytest.approx(found[0], rel=0.02)
