import itertools
import math

import pytest
from mock_rig import FAR, MS, make_rig

from lsds.contracts import Arm, ArmCommand, Twist
from lsds.errors import CommandExpired, DeviceFault, LifecycleError, LimitExceeded


def speed(rig):
    return rig.arm.read().tcp_twist.linear_m_s[2]


def test_it_is_an_arm():
    assert isinstance(make_rig().arm, Arm)


def test_velocity_is_followed_with_the_acceleration_asked_for():
    rig = make_rig()
    rig.until(100)
    rig.lift(0.038, acceleration=0.5)
    trace = []
    for t_ms in range(100, 300, 2):
        rig.until(t_ms)
        state = rig.arm.read()
        trace.append((state.t_ns, state.tcp_twist.linear_m_s[2], state.tcp_pose.position_m[2]))
    start = next(t for t, v, _ in trace if v > 0)
    assert 102 * MS <= start <= 108 * MS
    reached = next(t for t, v, _ in trace if v >= 0.038 - 1e-12)
    assert reached - start == pytest.approx(76 * MS, abs=3 * MS)
    climbs = [b[1] - a[1] for a, b in itertools.pairwise(trace)]
    assert max(climbs) <= 0.5 * 2e-3 + 1e-12
    distance = sum(v * 2e-3 for _, v, _ in trace)
    assert trace[-1][2] - trace[0][2] == pytest.approx(distance, abs=1e-6)


def test_it_comes_to_rest_when_the_command_expires():
    rig = make_rig()
    rig.until(100)
    rig.lift(expires_ns=300 * MS)
    rig.until(300)
    assert speed(rig) == pytest.approx(0.038)
    rig.until(340)
    assert speed(rig) == 0.0


def test_a_newer_command_outlives_an_older_ones_expiry():
    rig = make_rig()
    for t_ms in range(100, 1000, 40):
        rig.until(t_ms)
        rig.lift(expires_ns=(t_ms + 100) * MS)
    assert speed(rig) == pytest.approx(0.038)
    rig.until(960 + 100)
    assert speed(rig) == pytest.approx(0.038)
    rig.until(960 + 140)
    assert speed(rig) == 0.0


def test_stop_ends_motion_and_cancels_what_is_under_way():
    rig = make_rig()
    rig.until(100)
    rig.lift(0.2, acceleration=2.5)
    rig.until(300)
    rig.lift(0.3)
    rig.arm.stop()
    rig.until(400)
    assert speed(rig) == 0.0


def test_commands_are_limited_and_returned_as_sent():
    rig = make_rig()
    sent = rig.lift(7.0, acceleration=99.0)
    assert sent.twist.linear_m_s == (0.0, 0.0, 1.0)
    assert sent.acceleration_m_s2 == 2.5


def test_refusals():
    rig = make_rig()
    rig.until(100)
    with pytest.raises(CommandExpired):
        rig.lift(expires_ns=100 * MS)
    with pytest.raises(LimitExceeded):
        rig.lift(math.nan)
    with pytest.raises(LimitExceeded):
        rig.lift(0.03, acceleration=0.0)
    with pytest.raises(LimitExceeded, match="vertical"):
        rig.arm.command(ArmCommand(Twist((0.01, 0.0, 0.0)), 0.5, FAR))
    with pytest.raises(LimitExceeded, match="vertical"):
        rig.arm.command(ArmCommand(Twist(angular_rad_s=(0.0, 0.0, 0.1)), 0.5, FAR))
    rig.until(300)
    assert speed(rig) == 0.0


def test_protective_stop_as_a_fault():
    rig = make_rig(arm={"protective_stop_on_excess": True})
    rig.until(100)
    rig.lift(0.1)
    rig.until(400)
    with pytest.raises(DeviceFault, match="protective"):
        rig.lift(3.0)
    rig.until(600)
    assert speed(rig) == 0.0
    assert rig.arm.read().protective_stop
    with pytest.raises(DeviceFault):
        rig.lift(0.01)
    rig.arm.disarm()
    rig.arm.arm()
    rig.lift(0.01)
    assert not rig.arm.read().protective_stop


def test_commands_only_when_armed():
    rig = make_rig(ready=False)
    rig.arm.connect()
    rig.arm.read()
    rig.arm.stop()
    with pytest.raises(LifecycleError):
        rig.lift()
