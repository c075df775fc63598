"""The paper's demonstration: a pipe on a table, gripped and lifted at 3.8 cm/s."""

import numpy as np
import pytest
from lsds_mocks.plant.slip import STILL_STICKS
from mock_rig import STRONG_M, WEAK_M, demonstration, make_rig


def test_grip_slightly_too_weak_slides_up_the_standing_pipe_at_the_arms_speed():
    truths = demonstration(make_rig(), WEAK_M)
    late = [t for t in truths if t.t_ns > 1_500_000_000]
    needed = late[0].required_normal_force_n
    assert 0.75 * needed < late[0].normal_force_n < 0.9 * needed
    assert all(t.supported and t.object_height_m == 0 for t in late)
    assert [t.slip_velocity_m_s[1] for t in late] == pytest.approx([0.038] * len(late), rel=0.02)
    assert all(t.slip_velocity_m_s[0] == 0 for t in late)


def test_partial_slip_comes_before_gross_slip():
    rig = make_rig()
    ratios = []
    rig.until(100)
    rig.grip(WEAK_M)
    rig.until(1200)
    rig.lift(0.005)
    for t_ms in range(1204, 1600, 4):
        rig.until(t_ms)
        truth = rig.cell.truth()
        ratios.append(truth.stick_ratio)
        assert truth.stick_ratio <= STILL_STICKS or truth.slip_velocity_m_s == (0.0, 0.0)
    first_slip = ratios.index(0.0)
    assert ratios[0] > 0.9
    assert sum(0.0 < r < 0.9 for r in ratios[:first_slip]) >= 5


def test_slip_beyond_the_limit_counts_as_dropped_for_good():
    truths = demonstration(make_rig(), WEAK_M, until_ms=3200)
    assert truths[-1].slip_distance_m > 0.06
    first = next(i for i, t in enumerate(truths) if t.dropped)
    assert truths[first].slip_distance_m == pytest.approx(0.06, abs=1.5e-3)
    assert all(t.dropped for t in truths[first:])


def test_strong_grip_holds_with_less_than_a_millimetre():
    truths = demonstration(make_rig(), STRONG_M)
    last = truths[-1]
    assert last.slip_distance_m < 1e-3
    assert not last.dropped
    assert not last.supported
    assert last.object_height_m > 0.04
    assert 2 * last.tangential_force_n == pytest.approx(0.3 * 9.81, rel=0.01)


def test_opened_in_the_air_it_falls_and_counts_as_dropped():
    rig = make_rig()
    demonstration(rig, STRONG_M)
    rig.lift(0.0)
    rig.until(2700)
    assert not rig.cell.truth().dropped
    rig.grip(0.05)
    rig.until(3400)
    truth = rig.cell.truth()
    assert truth.dropped
    assert truth.supported
    assert truth.object_height_m == 0
    assert truth.normal_force_n == 0


def test_opened_on_the_table_nothing_drops():
    rig = make_rig()
    rig.until(100)
    rig.grip(STRONG_M)
    rig.until(1000)
    rig.grip(0.05)
    rig.until(2000)
    assert not rig.cell.truth().dropped
    assert rig.cell.truth().supported


def test_a_tick_is_a_fifth_of_the_force_or_less_and_a_few_catch_the_pipe():
    tick = 0.05 / 225
    rig = make_rig()
    demonstration(rig, WEAK_M, until_ms=1500)
    before = rig.cell.truth()
    rig.grip(WEAK_M - tick)
    rig.until(1600)
    one = rig.cell.truth().normal_force_n - before.normal_force_n
    assert 0.1 < one / before.required_normal_force_n < 0.2
    rig.grip(WEAK_M - 10 * tick)
    rig.until(2200)
    caught = rig.cell.truth()
    assert caught.slip_velocity_m_s == (0.0, 0.0)
    assert not caught.supported
    assert caught.normal_force_n < 3 * caught.required_normal_force_n


def test_required_force_counts_the_acceleration():
    rig = make_rig()
    rig.until(100)
    assert rig.cell.truth().required_normal_force_n == pytest.approx(0.3 * 9.81 / (2 * 0.55))
    rig.lift(0.2, acceleration=2.0)
    rig.until(130)
    assert rig.cell.truth().required_normal_force_n == pytest.approx(0.3 * 11.81 / (2 * 0.55))


def test_the_pipes_end_leaves_the_pad():
    rig = make_rig(cell={"length_mm": 70, "drop_slip_mm": 1000})
    truths = demonstration(rig, WEAK_M, until_ms=2600)
    forces = np.array([t.normal_force_n for t in truths])
    assert forces[0] > 2
    assert forces[-1] == 0
    # Shear and pressure are coupled: where it sticks and slips, the force trembles by some per cent.
    assert (np.diff(forces) <= 0.03 * forces[0]).all()
    assert (np.maximum.accumulate(forces[::-1])[::-1] - forces).max() <= 0.03 * forces[0]
    assert len(np.unique(forces.round(6))) > 5


def test_markers_tremble_more_the_faster_it_slips():
    def tremble(speed):
        rig = make_rig()
        rig.until(100)
        rig.grip(WEAK_M)
        rig.until(1200)
        rig.lift(speed)
        rig.until(1700)
        last, net = None, []
        for t_ms in range(1700, 1700 + int(min(1.0, 0.045 / speed) * 1000), 40):
            rig.until(t_ms)
            xy = rig.truth_now().xy_px
            if last is not None:
                net.append(np.linalg.norm((xy - last).mean(0)) / 0.04)
            last = xy
        return np.median(net)

    slow, fast = tremble(0.008), tremble(0.067)
    assert 0.5 < slow < fast
    assert 4 < fast < 60
