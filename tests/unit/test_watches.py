"""Devices without data, usable images or reactions are detected; healthy ones are not stopped."""

from __future__ import annotations

import numpy as np
import pytest

from lsds.contracts import ArmState, Contact, GripperState, Pose, Twist
from lsds.errors import SafetyStop
from lsds.safety.monitors import AHEAD_NS, ArrivalWatch, FollowWatch, Freshness
from lsds.tactile.gate import RepeatedImage

MS = 1_000_000


def test_a_source_may_be_without_for_its_limit_and_longer_at_the_start():
    fresh = Freshness("sensor", 0, 200 * MS, allowance_ns=3000 * MS, remedy="look at the cable")
    fresh.require(3200 * MS)
    with pytest.raises(SafetyStop, match=r"sensor: nothing usable for 3\.30 s.*look at the cable"):
        fresh.require(3300 * MS)
    fresh.good(3300 * MS)
    fresh.require(3500 * MS)
    fresh.bad("frame 7 is black")
    with pytest.raises(SafetyStop, match=r"the limit is 0\.20 s.*frame 7 is black"):
        fresh.require(3501 * MS)


def test_if_the_loop_itself_was_late_the_error_reports_it():
    fresh = Freshness("sensor left", 0, 200 * MS, remedy="look at the cable")
    for t_ms in range(0, 200, 10):
        fresh.require(t_ms * MS)
    with pytest.raises(SafetyStop, match=r"\(no new sample came; look at the cable\)"):
        fresh.require(201 * MS)
    fresh.good(300 * MS)
    with pytest.raises(SafetyStop, match=r"the loop itself was not run for 0\.25 s of it: the machine is busy"):
        fresh.require(550 * MS)


def test_an_image_is_repeated_only_where_every_pixel_is():
    watch = RepeatedImage()
    image = np.random.default_rng(0).integers(0, 255, (240, 320, 3), np.uint8)
    other = image.copy()
    other[7, 7] ^= 1
    assert not watch.seen(image)
    assert not watch.seen(other)
    assert watch.seen(other.copy())


def test_stamps_are_checked_not_believed():
    fresh = Freshness("sensor", 0, 200 * MS)
    assert fresh.stamped(100 * MS, 110 * MS)
    assert not fresh.stamped(100 * MS, 120 * MS), "the same stamp again"
    assert not fresh.stamped(90 * MS, 130 * MS), "back in time"
    assert not fresh.stamped(140 * MS + AHEAD_NS + 1, 140 * MS), "from the future"
    assert fresh.stamped(150 * MS, 160 * MS), "one stray stamp does no lasting harm"
    assert not fresh.stamped(170 * MS, 400 * MS), "too old when it came"
    with pytest.raises(SafetyStop):
        fresh.require(500 * MS)


def test_a_repeated_image_is_seen_even_where_the_buffer_is_reused():
    watch = RepeatedImage()
    buffer = np.random.default_rng(0).integers(0, 255, (240, 320, 3), np.uint8)
    assert not watch.seen(buffer)
    buffer[48] ^= 1
    assert not watch.seen(buffer), "new content in the same array"
    assert watch.seen(buffer)
    assert watch.seen(buffer.copy())


def gripper(t_ms, aperture, target, *, moving=False, contact=Contact.NONE):
    return GripperState(t_ms * MS, t_ms, aperture, target, moving, contact)


def test_a_grasp_has_arrived_when_the_gripper_reports_it():
    watch = ArrivalWatch(0.0002)
    assert not watch.arrived(gripper(10, 0.05, 0.05), 10 * MS), "nothing was sent"
    watch.sent(0.02, 0)
    assert not watch.arrived(None, 100 * MS)
    # Resting open before the command has arrived is no arrival, however long.
    assert not any(watch.arrived(gripper(t, 0.05, 0.05), t * MS) for t in range(10, 400, 10))
    assert not any(watch.arrived(gripper(t, 0.03, 0.02, moving=True), t * MS) for t in range(400, 900, 10))
    rests = [watch.arrived(gripper(t, 0.02, 0.02), t * MS) for t in range(900, 1100, 10)]
    assert rests.index(True) == 15


def test_resting_on_an_object_needs_the_contact_flag():
    for contact, arrives in ((Contact.NONE, False), (Contact.CLOSING, True)):
        watch = ArrivalWatch(0.0002)
        watch.sent(0.02, 0)
        states = [watch.arrived(gripper(t, 0.0243, 0.02, contact=contact), t * MS) for t in range(10, 400, 10)]
        assert any(states) is arrives


def test_a_command_that_is_not_echoed_is_lost_and_one_that_was_echoed_never_is():
    watch = ArrivalWatch(0.0002)
    watch.sent(0.02, 0)
    assert not watch.lost(gripper(400, 0.05, 0.05), 400 * MS)
    assert watch.lost(gripper(600, 0.05, 0.05), 600 * MS)
    assert watch.lost(None, 600 * MS)
    assert not watch.lost(gripper(600, 0.05, 0.02), 600 * MS)
    # A correction has closed the grip further: going back to what was sent would open it.
    assert not watch.lost(gripper(900, 0.018, 0.018), 2000 * MS)
    watch.sent(0.03, 2000 * MS)
    assert watch.lost(gripper(2600, 0.018, 0.018), 2600 * MS), "a new command may be lost again"


UP, TURN = Twist((0.0, 0.0, 0.038)), Twist(angular_rad_s=(0.0, 0.5, 0.0))


def arm(t_ms, speed, *, stopped=False):
    return ArmState(t_ms * MS, t_ms, Pose((0, 0, 0)), Twist((0.0, 0.0, speed)), stopped)


def test_an_arm_that_does_not_follow_is_noticed_and_one_that_does_is_not():
    watch = FollowWatch(100 * MS)
    for t in range(0, 5000, 10):
        watch.check(arm(t, 0.03), UP, t * MS)
    for t in range(5000, 6000, 10):
        watch.check(arm(t, 0.0), UP, t * MS)
    with pytest.raises(SafetyStop, match=r"moving at 0\.000 m/s"):
        watch.check(arm(6010, 0.0), UP, 6010 * MS)
    with pytest.raises(SafetyStop, match="protective stop"):
        FollowWatch(100 * MS).check(arm(0, 0.0, stopped=True), Twist(), 0)


def test_a_loop_that_is_late_is_blamed_instead_of_the_arm():
    """Commands expire while an algorithm computes, and the arm stops as it has to."""
    watch = FollowWatch(100 * MS)
    for t in range(0, 1200, 300):
        watch.run(t * MS)
        watch.check(arm(t, 0.0), UP, t * MS)
    with pytest.raises(SafetyStop, match=r"the loop itself was not run for up to 0\.30 s"):
        watch.check(arm(1200, 0.0), UP, 1200 * MS)


def test_an_arm_whose_states_are_slow_does_not_make_the_loop_late():
    watch = FollowWatch(100 * MS)
    for t in range(0, 960, 10):
        watch.run(t * MS)
        if t % 160 == 0:
            watch.check(arm(t, 0.0), UP, t * MS)
    with pytest.raises(SafetyStop, match="check remote control and obstacles"):
        watch.check(arm(1120, 0.0), UP, 1120 * MS)


def test_an_arm_that_shall_only_turn_and_does_not_is_noticed():
    watch = FollowWatch(100 * MS)
    turning = ArmState(0, 0, Pose((0, 0, 0)), TURN)
    watch.check(turning, TURN, 0)
    watch.check(arm(10, 0.0), TURN, 10 * MS)
    with pytest.raises(SafetyStop, match=r"moving at 0\.000 rad/s"):
        watch.check(arm(1020, 0.0), TURN, 1020 * MS)
