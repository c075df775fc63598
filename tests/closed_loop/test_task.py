"""The job's stages: by time, by events, never past a time-out."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.errors import SafetyStop
from lsds.task import LiftTask, Stage, TaskOptions

MS = 1_000_000
ORDER = list(Stage)


def test_the_stages_come_by_time_and_by_events():
    options = TaskOptions(settle_s=0.3, lift_s=0.5, hold_s=0.2)
    task = LiftTask(options, 1000 * MS)
    seen, moving_until = [], 2400
    for t_ms in range(1000, 4200, 10):
        if t_ms == 2000:
            task.reference_taken(t_ms * MS)
        stage = task.advance(t_ms * MS, 2000 <= t_ms <= moving_until)
        if not seen or seen[-1][1] is not stage:
            seen.append((t_ms, stage))
    # At rest since 2400 ms, 150 ms of which tell that it has arrived.
    assert seen == [
        (1000, Stage.REFERENCE),
        (2000, Stage.GRASP),
        (2550, Stage.SETTLE),
        (2850, Stage.LIFT),
        (3350, Stage.HOLD),
        (3550, Stage.DONE),
    ]


def test_a_gripper_that_moves_again_has_not_arrived():
    task = LiftTask(TaskOptions(), 0)
    task.reference_taken(0)
    for t_ms in range(0, 1000, 10):
        # A stall of 100 ms now and then is no arrival.
        assert task.advance(t_ms * MS, t_ms % 110 == 0) is Stage.GRASP


@pytest.mark.parametrize(("reference", "says"), [(False, "no reference frame"), (True, "did not come to rest")])
def test_what_takes_too_long_stops_the_cell(reference, says):
    task = LiftTask(TaskOptions(timeout_s=2.0), 0)
    if reference:
        task.reference_taken(0)
    assert task.advance(2000 * MS, True) in (Stage.REFERENCE, Stage.GRASP)
    with pytest.raises(SafetyStop, match=f"{says} within 2.0 s"):
        task.advance(2001 * MS, True)


def test_the_time_out_of_the_grasp_counts_from_its_own_beginning():
    task = LiftTask(TaskOptions(timeout_s=2.0), 0)
    task.advance(1900 * MS, False)
    task.reference_taken(1900 * MS)
    assert task.advance(3800 * MS, True) is Stage.GRASP
    with pytest.raises(SafetyStop):
        task.advance(3901 * MS, True)


def test_only_the_lift_moves_the_arm_and_only_lift_and_hold_answer_slip():
    task = LiftTask(TaskOptions(lift_speed_m_s=0.05), 0)
    for stage in Stage:
        task.stage = stage
        assert task.lift_speed_m_s == (0.05 if stage is Stage.LIFT else 0.0)
        assert task.corrects_grip == (stage in (Stage.LIFT, Stage.HOLD))


@given(
    st.lists(st.tuples(st.integers(1, 400), st.booleans()), min_size=1, max_size=80),
    st.floats(0, 0.5),
    st.floats(0, 0.5),
    st.floats(0, 0.5),
)
def test_stages_never_go_back_nor_skip_and_keep_their_time(ticks, settle, lift, hold):
    options = TaskOptions(settle_s=settle, lift_s=lift, hold_s=hold, timeout_s=600)
    task, now = LiftTask(options, 0), 0
    task.reference_taken(0)
    entered = {Stage.GRASP: 0}
    last = Stage.GRASP
    for step, moving in ticks:
        now += step * MS
        stage = task.advance(now, moving)
        assert ORDER.index(stage) - ORDER.index(last) in (0, 1)
        if stage is not last:
            entered[stage] = now
        last = stage
    least = {Stage.GRASP: 0.15, Stage.SETTLE: settle, Stage.LIFT: lift, Stage.HOLD: hold}
    for stage, began in entered.items():
        following = ORDER.index(stage) + 1
        ended = entered.get(ORDER[following]) if following < len(ORDER) else None
        if ended is not None:
            assert ended - began >= round(least[stage] * 1e9) - 1
