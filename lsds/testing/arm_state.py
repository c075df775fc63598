"""Checks of the state that an arm reports, and of poses."""

from __future__ import annotations

import math
from typing import Any

from lsds.contracts.devices import Lifecycle
from lsds.contracts.values import ArmState, Pose, PoseSample, Twist
from lsds.testing.bench import Bench
from lsds.testing.machine import a_command
from lsds.testing.outcomes import Needs

PLAUSIBLE_DISTANCE_M = 10.0
"""Maximum plausible distance of a body from the base, m."""
_UNIT = 1e-6
"""Maximum deviation of the norm of a unit quaternion; chosen."""


def check_arm_state_is_sound(bench: Bench) -> None:
    """States hold a pose in metres with a unit quaternion, within reach, and a finite twist within the speed limit."""
    with bench.device() as arm:
        reach_m = arm.spec.reach_m
        for state in bench.samples(arm, 0.2):
            assert isinstance(state, ArmState), f"read() returned {type(state).__name__}; return an ArmState"
            assert_pose(state.tcp_pose, "the TCP", 1.5 * reach_m + 1.0)
            assert_twist(state.tcp_twist, arm.spec.speed_m_s)
            assert isinstance(state.protective_stop, bool), f"protective_stop is {state.protective_stop!r}, not a bool"


def check_arm_rests_until_commanded(bench: Bench) -> None:
    """An armed arm without a command rests, and its twist is zero."""
    if not bench.may_move:
        raise Needs("motion")
    with bench.device(Lifecycle.ARMED) as arm:
        bench.advance(0.3)
        start = bench.read(arm)
        bench.advance(0.5)
        end = bench.read(arm)
        moved = math.dist(start.tcp_pose.position_m, end.tcp_pose.position_m)
        assert moved < 5e-4, f"the arm moved by {moved * 1e3:.1f} mm in 0.5 s without a command; rest until commanded"
        speed = math.hypot(*end.tcp_twist.linear_m_s)
        assert speed < 1e-3, f"tcp_twist is {speed} m/s at rest; report the measured velocity"


def check_arm_rests_after_disarm(bench: Bench) -> None:
    """`disarm` brings a moving arm to rest."""
    if not bench.may_move:
        raise Needs("motion")
    with bench.device(Lifecycle.ARMED) as arm:
        arm.command(a_command(bench, bench.in_future(10.0)))
        bench.advance(0.2)
        arm.disarm()
        bench.advance(1.0)
        start = bench.read(arm).tcp_pose.position_m
        bench.advance(0.5)
        moved = math.dist(start, bench.read(arm).tcp_pose.position_m)
        assert moved < 5e-4, f"the arm moves on by {moved * 1e3:.1f} mm in 0.5 s after disarm(); stop it in disarm()"


def check_poses(bench: Bench) -> None:
    """Poses are in metres, finite, with unit quaternions, by the name of the body."""
    with bench.device() as device:
        for sample in bench.samples(device, 0.3):
            assert isinstance(sample, PoseSample), f"read() returned {type(sample).__name__}; return a PoseSample"
            for body, pose in sample.poses.items():
                assert isinstance(body, str), f"the body {body!r} is not named by a str"
                assert_pose(pose, body, PLAUSIBLE_DISTANCE_M)


def assert_pose(pose: Any, body: str, farthest_m: float) -> None:
    """Require a finite pose in metres with a unit quaternion."""
    assert isinstance(pose, Pose), f"{body}: the pose is {type(pose).__name__}; return a Pose"
    finite = len(pose.position_m) == 3 and all(map(math.isfinite, pose.position_m))
    assert finite, f"{body}: position_m is {pose.position_m}; leave out a body that is not seen"
    distance_m = math.hypot(*pose.position_m)
    assert distance_m <= farthest_m, (
        f"{body}: position_m is {pose.position_m}, {distance_m:g} m away, and at most {farthest_m:g} m are plausible; "
        "report metres"
    )
    norm = math.hypot(*pose.quaternion_xyzw)
    assert len(pose.quaternion_xyzw) == 4, f"{body}: quaternion_xyzw is {pose.quaternion_xyzw}; report x, y, z, w"
    assert abs(norm - 1) < _UNIT, (
        f"{body}: quaternion_xyzw is {pose.quaternion_xyzw}, of length {norm:g}, not 1; normalise it"
    )


def assert_twist(twist: Any, limit_m_s: float) -> None:
    """Require a finite twist within a speed limit."""
    assert isinstance(twist, Twist), f"tcp_twist is {type(twist).__name__}; return a Twist"
    assert all(map(math.isfinite, (*twist.linear_m_s, *twist.angular_rad_s))), f"the twist is {twist}, not finite"
    speed = math.hypot(*twist.linear_m_s)
    assert speed <= 2 * limit_m_s, f"the twist is {speed} m/s, and the spec declares {limit_m_s} m/s; report m/s"


ARM_STATE_CHECKS = (check_arm_state_is_sound, check_arm_rests_until_commanded, check_arm_rests_after_disarm)
POSE_CHECKS = (check_poses,)
