"""Fingers that open by themselves or do not follow stop the cell; those of a slow gripper do not."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.contracts import Contact, GripperState
from lsds.errors import DeviceFault, SafetyStop
from lsds.safety.gripper_monitor import FingersWatch

MS = 1_000_000
TICK_M = 2.2e-4


def state(t_ms, mm, *, target_mm=None, moving=False, contact=Contact.NONE):
    target = mm if target_mm is None else target_mm
    return GripperState(t_ms * MS, t_ms, mm * 1e-3, target * 1e-3, moving, contact)


def send(watch, mm, t_ms, *, corrects=True):
    watch.sent(mm * 1e-3, mm * 1e-3, t_ms * MS, corrects=corrects)


def test_fingers_that_open_with_no_command_stop_the_cell():
    watch = FingersWatch(TICK_M)
    send(watch, 20.0, 0)
    for t, mm in enumerate((40, 35, 30, 25, 22, 22, 22)):
        watch.check(state(100 * t, mm, target_mm=20, moving=mm > 22, contact=Contact.CLOSING), 100 * t * MS)
    with pytest.raises(SafetyStop, match=r"opened from 22\.00 to 23\.00 mm; no command asked for it"):
        watch.check(state(700, 23.0), 700 * MS)


def test_fingers_commanded_to_open_may_still_do_so_after_the_next_command():
    watch = FingersWatch(TICK_M)
    send(watch, 20.0, 0)
    watch.check(state(10, 20.0), 10 * MS)
    send(watch, 24.0, 20)
    send(watch, 21.0, 100)
    for t, mm in ((150, 22.0), (200, 23.9), (300, 22.5), (400, 21.0)):
        watch.check(state(t, mm, moving=True), t * MS)
    with pytest.raises(SafetyStop, match="opened"):
        watch.check(state(900, 23.0, moving=True), 900 * MS)


@pytest.mark.parametrize(("hears", "patience"), [(True, r"0\.4"), (False, r"1\.0")])
def test_fingers_that_do_not_follow_stop_the_cell_though_commands_go_on(hears, patience):
    watch = FingersWatch(TICK_M)

    def go_on():
        for t in range(0, 2000, 40):
            send(watch, 19 - t * 2e-3, t)
            watch.check(state(t, 20.0, target_mm=19 - t * 2e-3 if hears else None), t * MS)

    with pytest.raises(SafetyStop, match=rf"commanded to 1\d\.\d\d mm, it stays at 20\.00 mm.*{patience} s"):
        go_on()


def test_fingers_that_report_motion_without_moving_stop_the_cell_and_slow_ones_do_not():
    slow, frozen = FingersWatch(TICK_M), FingersWatch(TICK_M)
    send(slow, 10.0, 0)
    send(frozen, 10.0, 0)
    for t in range(0, 2000, 20):
        slow.check(state(t, 20.0 - 2e-3 * t, target_mm=10, moving=True), t * MS)

    def go_on():
        for t in range(0, 2000, 20):
            frozen.check(state(t, 20.0, target_mm=10, moving=True), t * MS)

    with pytest.raises(SafetyStop, match=r"commanded to 10\.00 mm, it stays at 20\.00 mm"):
        go_on()


def test_a_correction_that_was_lost_is_sent_again_and_a_slow_gripper_has_time_to_follow_it():
    watch = FingersWatch(TICK_M)
    send(watch, 20.0, 0)
    watch.check(state(0, 20.0), 0)
    send(watch, 15.0, 10)
    repeated = []
    for t in range(10, 3000, 10):
        heard = bool(repeated) and t >= repeated[0] + 200
        now = state(t, 15.0 if heard else 20.0, target_mm=15.0 if heard else 20.0)
        watch.check(now, t * MS)
        if watch.lost(now, t * MS):
            repeated.append(t)
            send(watch, 15.0, t)
    assert repeated == [420]


def test_a_lost_closing_is_sent_again_if_the_fingers_still_open():
    watch = FingersWatch(TICK_M)
    send(watch, 20.0, 0)
    watch.check(state(0, 20.0), 0)
    send(watch, 26.0, 100, corrects=False)
    send(watch, 21.0, 200)
    asked = [t for t in range(200, 1000, 10) if watch.lost(state(t, 20.0, target_mm=26.0), t * MS)]
    for t in range(200, 1000, 10):
        watch.check(state(t, 20 + 0.006 * (t - 200), target_mm=26.0, moving=True), t * MS)
    assert asked[0] == 610
    with pytest.raises(SafetyStop, match="opened"):
        watch.check(state(1500, 26.0, target_mm=21.0, moving=True), 1500 * MS)


def test_a_slow_gripper_and_one_that_rests_on_an_object_follow():
    watch = FingersWatch(5e-4)
    send(watch, 15.0, 0)
    for t in range(0, 4000, 10):
        # 0.2 s of delay, 2 mm/s.
        watch.check(state(t, 20.0 - 2e-3 * max(0, t - 200), moving=t > 200), t * MS)
    watch = FingersWatch(TICK_M)
    send(watch, 15.0, 0)
    for t in range(0, 4000, 10):
        watch.check(state(t, 20.0, contact=Contact.CLOSING), t * MS)


def test_a_grasp_that_was_lost_on_the_way_has_the_patience_of_the_grasp():
    watch = FingersWatch(TICK_M)
    send(watch, 15.0, 0, corrects=False)
    for t in range(0, 4000, 10):
        watch.check(state(t, 50.0), t * MS)


def test_a_gripper_that_takes_a_wider_aperture_than_commanded_is_at_fault():
    watch = FingersWatch(TICK_M)
    watch.sent(0.0, 0.002, 0, corrects=False)  # its least aperture
    watch.check(state(0, 19.9), 0)
    watch.sent(0.020, 0.0201, 0, corrects=True)
    watch.sent(0.020, 0.018, 0, corrects=True)
    with pytest.raises(DeviceFault, match=r"took 20\.50 mm for 20\.00 mm"):
        watch.sent(0.020, 0.0205, 0, corrects=True)


@given(st.lists(st.tuples(st.integers(1, 200), st.floats(0, 50)), min_size=1, max_size=40))
def test_fingers_that_follow_their_commands_never_stop_the_cell(commands):
    watch, aperture, t = FingersWatch(TICK_M), 50.0, 0
    watch.check(state(0, aperture), 0)
    for wait, target in commands:
        send(watch, target, t)
        for _ in range(wait // 10 + 1):
            t += 10
            aperture += max(-1.5, min(1.5, target - aperture))
            watch.check(state(t, aperture, target_mm=target, moving=aperture != target), t * MS)


def test_a_correction_that_is_rounded_away_is_a_fault_though_nothing_opens():
    watch = FingersWatch(TICK_M)
    watch.sent(0.0241, 0.024, 0, corrects=False)
    watch.check(state(0, 24.0), 0)
    watch.sent(0.0236, 0.024, 0, corrects=False)
    with pytest.raises(DeviceFault, match=r"took 24\.00 mm for 23\.60 mm, wider by more than its resolution"):
        watch.sent(0.0236, 0.024, 0, corrects=True)
