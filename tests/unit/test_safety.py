from __future__ import annotations

import math
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.clock import WallClock
from lsds.contracts import ArmCommand, GripperCommand, Twist
from lsds.errors import LimitExceeded, SafetyStop
from lsds.safety.guard import Guard, SafetyOptions
from lsds.safety.watchdog import Watchdog

OPTIONS = SafetyOptions(
    max_grip_force_n=50, max_finger_speed_m_s=0.1, max_arm_speed_m_s=0.05, min_aperture_m=0.002, max_aperture_m=0.04
)
finite = st.floats(-1e6, 1e6)
positive = st.floats(0, 1e6)


def grip(aperture=0.02, speed=0.05, force=20.0):
    return GripperCommand(aperture, speed, force, expires_ns=10)


def test_values_within_the_limits_are_unchanged():
    guard = Guard(OPTIONS)
    assert guard.gripper(grip(), 0.03, opens_by_m=0.0) == grip()
    command = ArmCommand(Twist((0.0, 0.0, 0.03)), 0.5, 10)
    assert guard.arm(command) == command
    assert all(getattr(guard.counts, name) == 0 for name in guard.counts.__slots__)


def test_every_limit_clamps_and_counts():
    guard = Guard(OPTIONS)
    sent = guard.gripper(grip(0.0, 1.0, 200.0), 0.03, opens_by_m=0.0)
    assert (sent.aperture_m, sent.speed_m_s, sent.force_n, sent.expires_ns) == (0.002, 0.1, 50.0, 10)
    assert (guard.counts.aperture, guard.counts.finger_speed, guard.counts.force) == (1, 1, 1)
    assert guard.gripper(grip(0.05), 0.03, opens_by_m=math.inf).aperture_m == 0.04


def test_a_correction_never_opens_unless_it_is_allowed_to():
    guard = Guard(OPTIONS)
    assert guard.gripper(grip(0.03), 0.02, opens_by_m=0.0).aperture_m == 0.02
    assert guard.counts.kept_closed == 1
    assert guard.gripper(grip(0.03), 0.02, opens_by_m=math.inf).aperture_m == 0.03
    assert guard.counts.kept_closed == 1


@given(finite, positive, positive, st.floats(0, 0.1))
def test_the_gripper_guard_is_idempotent_and_closes_only(aperture, speed, force, held):
    guard = Guard(OPTIONS)
    once = guard.gripper(grip(aperture, speed, force), held, opens_by_m=0.0)
    assert once.aperture_m <= held
    assert once.force_n <= 50
    assert once.speed_m_s <= 0.1
    assert guard.gripper(once, held, opens_by_m=0.0) == once or held < OPTIONS.min_aperture_m


@given(st.tuples(finite, finite, finite), st.tuples(finite, finite, finite), st.floats(1e-3, 1e6))
def test_the_arm_guard_keeps_directions(linear, angular, acceleration):
    sent = Guard(OPTIONS).arm(ArmCommand(Twist(linear, angular), acceleration, 10))
    for asked, got, limit in [
        (linear, sent.twist.linear_m_s, OPTIONS.max_arm_speed_m_s),
        (angular, sent.twist.angular_rad_s, OPTIONS.max_arm_angular_rad_s),
    ]:
        assert math.hypot(*got) <= limit * (1 + 1e-9)
        scale = min(1.0, limit / math.hypot(*asked)) if any(asked) else 1.0
        assert got == pytest.approx([scale * value for value in asked], rel=1e-9, abs=1e-12)
    assert sent.acceleration_m_s2 <= OPTIONS.max_arm_acceleration_m_s2


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_nan_is_rejected(bad):
    guard = Guard(OPTIONS)
    for command in (grip(bad), grip(speed=bad), grip(force=bad)):
        with pytest.raises(LimitExceeded, match="not sent"):
            guard.gripper(command, 0.02, opens_by_m=math.inf)
    with pytest.raises(LimitExceeded):
        guard.gripper(grip(), bad, opens_by_m=0.0)
    for arm in (ArmCommand(Twist((0.0, bad, 0.0)), 1, 0), ArmCommand(Twist((0, 0, 0), (bad, 0, 0)), 1, 0)):
        with pytest.raises(LimitExceeded):
            guard.arm(arm)


def test_nonsense_magnitudes_are_refused():
    guard = Guard(OPTIONS)
    with pytest.raises(LimitExceeded, match="negative"):
        guard.gripper(grip(speed=-0.1), 0.02, opens_by_m=0.0)
    with pytest.raises(LimitExceeded, match="positive"):
        guard.arm(ArmCommand(Twist(), 0.0, 0))


class Time:
    def __init__(self):
        self.now = 0

    def __call__(self):
        return self.now


def test_the_watchdog_reports_what_was_late_the_loop_or_the_machine():
    now = [0]
    dog = Watchdog(lambda: None, 0.4, lambda: now[0], lambda: "read() of sensor 'left'")
    for now[0] in range(0, 500_000_001, 100_000_000):
        dog.poll()
    with pytest.raises(SafetyStop, match=r"watchdog: the loop was silent for 0\.500 s.*in read\(\) of sensor 'left'"):
        dog.check()
    now = [0]
    dog = Watchdog(lambda: None, 0.4, lambda: now[0], lambda: "read() of sensor 'left'")
    now[0] = 700_000_000
    dog.poll()
    cause = ValueError("led to")
    with pytest.raises(
        SafetyStop, match=r"the watchdog itself was not run for 0\.600 s.*the machine is busy"
    ) as caught:
        dog.check(cause)
    assert caught.value.__cause__ is cause


def test_the_watchdog_stops_once_when_starved():
    time, stops = Time(), []
    dog = Watchdog(lambda: stops.append(1), 0.5, time)
    time.now = 500_000_000
    assert not dog.poll()
    dog.check()
    time.now += 1
    assert dog.poll()
    assert dog.poll()
    assert stops == [1]
    dog.feed()
    with pytest.raises(SafetyStop, match=r"silent for 0\.500 s, the limit is 0\.500 s"):
        dog.check()


def test_feeding_keeps_it_quiet():
    time = Time()
    dog = Watchdog(pytest.fail, 0.5, time)
    for _ in range(10):
        time.now += 400_000_000
        assert not dog.poll()
        dog.feed()


def test_a_stop_that_raises_is_reported():
    time = Time()

    def stop():
        raise OSError("cable")

    dog = Watchdog(stop, 0.1, time)
    time.now = 10**9
    dog.poll()
    with pytest.raises(SafetyStop, match="stopping raised OSError: cable"):
        dog.check()


def test_the_thread_stops_a_loop_that_hangs():
    stopped = threading.Event()
    with Watchdog(stopped.set, 0.05, WallClock().now) as dog:
        assert stopped.wait(5), "the watchdog never fired"
    with pytest.raises(SafetyStop):
        dog.check()


def test_the_thread_ends_when_closed():
    # Threads of earlier tests may end meanwhile.
    before = set(threading.enumerate())
    dog = Watchdog(lambda: None, 60, WallClock().now)
    with dog:
        (own,) = set(threading.enumerate()) - before
    dog.close()
    assert not own.is_alive()
    assert not dog.fired
