"""The cell: the same seed and times give identical bits, independent of reads in between."""

import json

import numpy as np
import pytest
from mock_rig import MS, STRONG_M, WEAK_M, demonstration, make_rig

from lsds.contracts import Cell


def frames(rig, until_ms, every_ms):
    out = {}
    while rig.clock.now() < until_ms * MS:
        rig.until(rig.clock.now() / MS + every_ms)
        if rig.clock.now() > 200 * MS:
            frame = rig.sensor.read()
            out[frame.seq] = frame
    return out


def run(seed, every_ms):
    rig = make_rig(seed, cell={"fidelity": "auto"})
    rig.until(100, every_ms)
    rig.grip(WEAK_M)
    rig.until(700, every_ms)
    rig.lift()
    return frames(rig, 1200, every_ms), rig


def test_it_is_a_cell():
    assert isinstance(make_rig().cell, Cell)


def test_same_seed_same_bits():
    (first, one), (second, two) = run(3, 20), run(3, 20)
    assert first.keys() == second.keys()
    assert all(np.array_equal(first[k].image, second[k].image) and first[k].t_ns == second[k].t_ns for k in first)
    assert one.cell.truth() == two.cell.truth()


def test_another_seed_differs():
    (first, one), (second, two) = run(3, 20), run(4, 20)
    assert any(first[k].t_ns != second[k].t_ns for k in first.keys() & second.keys())
    common = max(first.keys() & second.keys())
    assert not np.array_equal(first[common].image, second[common].image)
    assert one.cell.truth() != two.cell.truth()


@pytest.mark.parametrize("every_ms", [1, 7.3, 100])
def test_granularity_of_advance_changes_nothing(every_ms):
    def outcome(portion):
        rig = make_rig(5)
        rig.until(100, portion)
        rig.grip(WEAK_M)
        rig.until(700, portion)
        rig.lift()
        rig.until(1200, portion)
        return rig.cell.truth(), rig.sensor.read()

    (truth, frame), (other_truth, other_frame) = outcome(None), outcome(every_ms)
    assert truth == other_truth
    assert (frame.t_ns, frame.seq) == (other_frame.t_ns, other_frame.seq)
    assert np.array_equal(frame.image, other_frame.image)


def test_order_of_calls_at_one_instant_changes_nothing():
    def outcome(gripper_first):
        rig = make_rig(5)
        rig.until(100)
        calls = [lambda: rig.grip(STRONG_M), lambda: rig.lift(0.01)]
        for call in calls if gripper_first else reversed(calls):
            call()
        rig.until(900)
        return rig.cell.truth()

    assert outcome(True) == outcome(False)


def test_time_already_passed_is_ignored():
    rig = make_rig()
    rig.until(500)
    before = rig.cell.truth()
    rig.cell.advance(100 * MS)
    assert rig.cell.truth() == before


def test_truth_is_stamped_with_the_last_whole_step():
    rig = make_rig()
    rig.until(501)
    assert rig.cell.truth().t_ns == 500 * MS


def test_history_keeps_every_step_when_asked():
    rig = make_rig(cell={"history_s": 0.5})
    rig.until(2000)
    history = rig.cell.history()
    assert len(history) == 250
    assert [t.t_ns for t in history] == list(range(1502 * MS, 2001 * MS, 2 * MS))
    assert make_rig().cell.history() == ()


def test_mocks_without_a_configured_cell_meet_in_a_default_one():
    rig = make_rig()
    assert rig.sensor.cell is rig.gripper.cell is rig.arm.cell is rig.cell


@pytest.mark.parametrize("step_ms", [0.5, 5])
def test_physics_step_hardly_matters(step_ms):
    base = demonstration(make_rig(), WEAK_M, until_ms=1800)[-1]
    other = demonstration(make_rig(cell={"step_ms": step_ms}), WEAK_M, until_ms=1800)[-1]
    assert other.slip_distance_m == pytest.approx(base.slip_distance_m, rel=0.02)


def test_a_clock_that_starts_late_works_alike():
    rig = make_rig(start_ns=10**15 + 1)
    rig.clock.sleep_until(10**15 + 400 * MS)
    assert rig.sensor.read().t_ns > 10**15
    assert rig.cell.truth().supported


def test_a_cell_reports_its_model_and_its_limits():
    gentle, firm = (make_rig(cell={"fidelity": model}) for model in ("winkler", "auto"))
    for rig, aperture in ((gentle, 0.0245), (firm, 0.0205)):
        rig.until(100)
        rig.grip(aperture)
        rig.until(900)
        rig.lift()
        rig.until(1300)
    report = gentle.cell.fidelity()
    assert report["model"] == "winkler"
    assert "is not checked" in report["summary"]
    assert report["warnings"] == []
    report = firm.cell.fidelity()
    assert report["model"] == "auto"
    assert "0.96 mm" in report["summary"]
    assert "20 um allowed" in report["summary"]
    assert any("% of the thickness" in warning for warning in report["warnings"])
    assert json.loads(json.dumps(report)) is not None
