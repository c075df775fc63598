"""The job's stages: by time, by events, never past a time-out."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from lsds.errors import SafetyStop
from lsds.task import LiftTask, Stage, TaskOptions

MS = 1_000_000
ORDER = list(Stage)


def test_the_stages_come_by_time_and_by_events():
    options = TaskOptions(settle_s=0.3, lift_s=0.5, hold_s=0.2)
    task = LiftTask(options, 1000 * MS)
    seen = []
    for t_ms in range(1000, 4200, 10):
        if t_ms == 2000:
            task.reference_taken(t_ms * MS)
        stage = task.advance(t_ms * MS, grasped=t_ms >= 2550)
        if not seen or seen[-1][1] is not stage:
            seen.append((t_ms, stage))
    assert seen == [
        (1000, Stage.REFERENCE),
        (2000, Stage.GRASP),
        (2550, Stage.SETTLE),
        (2850, Stage.LIFT),
        (3350, Stage.HOLD),
        (3550, Stage.DONE),
    ]
    assert task.lift_began_ns == 2850 * MS


@pytest.mark.parametrize(("reference", "says"), [(False, "no reference frame"), (True, "nothing was grasped")])
def test_what_takes_too_long_stops_the_cell(reference, says):
    task = LiftTask(TaskOptions(timeout_s=2.0), 0)
    if reference:
        task.reference_taken(0)
    assert task.advance(2000 * MS, False) in (Stage.REFERENCE, Stage.GRASP)
    with pytest.raises(SafetyStop, match=f"{says}.* within 2.0 s"):
        task.advance(2001 * MS, False)


def test_the_time_out_of_the_grasp_counts_from_its_own_beginning():
    task = LiftTask(TaskOptions(timeout_s=2.0), 0)
    task.advance(1900 * MS, False)
    task.reference_taken(1900 * MS)
    assert task.advance(3800 * MS, False) is Stage.GRASP
    with pytest.raises(SafetyStop):
        task.advance(3901 * MS, False)


@pytest.mark.parametrize("wrong", [{"lift_s": True}, {"hold_s": "1"}, {"lift_speed_m_s": float("nan")}])
def test_options_of_the_wrong_type_are_refused(wrong):
    with pytest.raises(ValidationError):
        TaskOptions(**wrong)


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
    for step, grasped in ticks:
        now += step * MS
        stage = task.advance(now, grasped)
        assert ORDER.index(stage) - ORDER.index(last) in (0, 1)
        if stage is not last:
            entered[stage] = now
        last = stage
    least = {Stage.GRASP: 0.0, Stage.SETTLE: settle, Stage.LIFT: lift, Stage.HOLD: hold}
    for stage, began in entered.items():
        following = ORDER.index(stage) + 1
        ended = entered.get(ORDER[following]) if following < len(ORDER) else None
        if ended is not None:
            assert ended - began >= round(least[stage] * 1e9) - 1
