"""Checks of moving devices: grippers and arms. They run on real hardware only with permission."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from lsds.contracts.devices import Gripper, Lifecycle
from lsds.contracts.values import ArmCommand, Contact, GripperCommand, Twist
from lsds.errors import CommandExpired, LifecycleError, LimitExceeded
from lsds.testing.bench import Bench
from lsds.testing.machine import a_command

_SOON_S = 0.2
"""An expiry long enough for a driver on a busy machine, and shorter than a slow motion."""


def check_refuses_before_arm(bench: Bench) -> None:
    """A device that is connected but not armed refuses commands."""
    with bench.device() as device, pytest.raises(LifecycleError):
        device.command(a_command(bench, bench.in_future()))


def check_refuses_what_is_not_finite(bench: Bench) -> None:
    """NaN and infinity in any field raise LimitExceeded."""
    with bench.device(Lifecycle.ARMED) as device:
        good = a_command(bench, bench.in_future(60.0))
        for bad in (math.nan, math.inf, -math.inf):
            if bench.kind == "gripper":
                commands = [replace(good, **{field: bad}) for field in ("aperture_m", "speed_m_s", "force_n")]
            else:
                commands = [replace(good, twist=Twist((bad, 0.0, 0.0))), replace(good, acceleration_m_s2=bad)]
            for command in commands:
                with pytest.raises(LimitExceeded):
                    device.command(command)


def check_refuses_what_is_expired(bench: Bench) -> None:
    """A command received after its expiry is not executed."""
    with bench.device(Lifecycle.ARMED) as device:
        bench.advance(0.01)
        with pytest.raises(CommandExpired):
            device.command(a_command(bench, bench.clock.now() - 1))


def check_commands_do_not_block(bench: Bench) -> None:
    """`command` returns before the motion ends: no simulated time passes in it."""
    with bench.device(Lifecycle.ARMED) as device:
        before = bench.clock.now()
        device.command(a_command(bench, bench.in_future()))
        if bench.virtual:
            assert bench.clock.now() == before


def check_gripper_sends_within_its_spec(bench: Bench) -> None:
    """The returned command is the one sent: within the declared ranges, and close to the requested one if possible."""
    with bench.device(Lifecycle.ARMED) as gripper:
        spec = gripper.spec
        for aperture, speed, force in [
            (spec.stroke_m / 2, sum(spec.speed_m_s) / 2, sum(spec.force_n) / 2),
            (spec.stroke_m * 5, spec.speed_m_s[1] * 5, spec.force_n[1] * 5),
            (-0.01, 0.0, 0.0),
        ]:
            sent = gripper.command(GripperCommand(aperture, speed, force, bench.in_future()))
            assert -1e-9 <= sent.aperture_m <= spec.stroke_m + spec.resolution_m
            assert spec.speed_m_s[0] * 0.999 <= sent.speed_m_s <= spec.speed_m_s[1] * 1.001
            assert spec.force_n[0] * 0.999 <= sent.force_n <= spec.force_n[1] * 1.001
            wanted = min(max(aperture, 0.0), spec.stroke_m)
            assert abs(sent.aperture_m - wanted) <= spec.resolution_m * 1.01


def check_gripper_reaches_what_was_sent(bench: Bench) -> None:
    """The empty gripper moves to the aperture that `command` returned, and stays there."""
    with bench.device(Lifecycle.ARMED) as gripper:
        spec = gripper.spec
        sent = gripper.command(
            GripperCommand(spec.stroke_m * 0.8, spec.speed_m_s[1], spec.force_n[1], bench.in_future())
        )

        def arrived() -> bool:
            return _is_at(bench, gripper, sent)

        assert bench.settle(arrived, 5.0), f"at {bench.read(gripper).aperture_m}, sent to {sent.aperture_m}"
        bench.advance(0.5)
        assert arrived(), "the gripper did not stay at its target"


def check_gripper_never_opens_on_failure(bench: Bench) -> None:
    """Refused and expired commands, an expiry during motion, stop and disarm do not open the gripper."""
    with bench.device(Lifecycle.ARMED) as gripper:
        spec = gripper.spec
        sent = gripper.command(
            GripperCommand(spec.stroke_m * 0.5, spec.speed_m_s[1], spec.force_n[1], bench.in_future(_SOON_S))
        )
        bench.settle(lambda: _is_at(bench, gripper, sent), 3.0)
        held = bench.read(gripper).aperture_m
        wide = GripperCommand(spec.stroke_m, spec.speed_m_s[1], spec.force_n[1], bench.in_future())
        with pytest.raises(LimitExceeded):
            gripper.command(replace(wide, force_n=math.nan))
        with pytest.raises(CommandExpired):
            gripper.command(replace(wide, expires_ns=bench.clock.now() - 1))
        for end in (gripper.stop, gripper.disarm):
            end()
            bench.advance(0.5)
            now_m = bench.read(gripper).aperture_m
            assert now_m <= held + 2 * spec.resolution_m, f"opened from {held} to {now_m} m"


def check_gripper_finishes_after_expiry(bench: Bench) -> None:
    """A motion in progress continues to its target when its command expires, so that the object is not dropped."""
    with bench.device(Lifecycle.ARMED) as gripper:
        spec = gripper.spec
        start = bench.read(gripper).aperture_m
        target = 0.0 if start > spec.stroke_m / 2 else spec.stroke_m
        sent = gripper.command(GripperCommand(target, spec.speed_m_s[0], spec.force_n[0], bench.in_future(_SOON_S)))

        def ended() -> bool:
            # An object in the way also ends the motion, and the gripper reports it.
            return _is_at(bench, gripper, sent) or bench.read(gripper).contact is not Contact.NONE

        assert bench.settle(ended, 3 * spec.stroke_m / spec.speed_m_s[0] + 2), (
            f"stopped at {bench.read(gripper).aperture_m} m on the way from {start} to {sent.aperture_m} m"
        )


def check_arm_sends_within_its_spec(bench: Bench) -> None:
    """The returned command is the one sent, within the declared speed and acceleration."""
    with bench.device(Lifecycle.ARMED) as arm:
        spec = arm.spec
        asked = Twist((0.0, 0.0, spec.speed_m_s * 5))
        sent = arm.command(ArmCommand(asked, spec.acceleration_m_s2 * 5, bench.in_future()))
        assert math.hypot(*sent.twist.linear_m_s) <= spec.speed_m_s * 1.001
        assert sent.acceleration_m_s2 <= spec.acceleration_m_s2 * 1.001


def check_arm_moves_as_sent(bench: Bench) -> None:
    """While commands are renewed, the arm moves at the velocity that `command` returned."""
    with bench.device(Lifecycle.ARMED) as arm:
        start = bench.read(arm)
        wanted = math.nan
        for _ in range(100):
            wanted = arm.command(a_command(bench, bench.in_future(0.1))).twist.linear_m_s[2]
            bench.advance(0.01)
        end = bench.read(arm)
        moved = end.tcp_pose.position_m[2] - start.tcp_pose.position_m[2]
        # A busy machine takes longer than it was asked to.
        due = wanted * (end.t_ns - start.t_ns) * 1e-9
        assert abs(end.tcp_twist.linear_m_s[2] - wanted) <= 0.1 * wanted
        assert 0.7 * due <= moved <= 1.1 * due, f"moved {moved} m where {due} m are due at {wanted} m/s"


def check_arm_rests_after_expiry(bench: Bench) -> None:
    """Without a newer command the arm decelerates to rest after the expiry, and reports it."""
    with bench.device(Lifecycle.ARMED) as arm:
        command = a_command(bench, bench.in_future(0.1))
        sent = arm.command(command)
        bench.advance(0.09)
        speed = math.hypot(*sent.twist.linear_m_s)
        bench.advance(0.01 + speed / command.acceleration_m_s2 + 0.25)
        rest = bench.read(arm)
        assert math.hypot(*rest.tcp_twist.linear_m_s) < 1e-3, "still moving after expiry and deceleration"
        bench.advance(0.5)
        drift = math.dist(bench.read(arm).tcp_pose.position_m, rest.tcp_pose.position_m)
        assert drift < 5e-4, f"drifted {drift} m at rest"


def check_arm_rests_after_stop(bench: Bench) -> None:
    """`stop` brings a moving arm to rest."""
    with bench.device(Lifecycle.ARMED) as arm:
        arm.command(a_command(bench, bench.in_future(10.0)))
        bench.advance(0.2)
        arm.stop()
        bench.advance(1.0)
        assert math.hypot(*bench.read(arm).tcp_twist.linear_m_s) < 1e-3


def _is_at(bench: Bench, gripper: Gripper, sent: GripperCommand) -> bool:
    tolerance = 2 * gripper.spec.resolution_m + 1e-4
    return bool(abs(bench.read(gripper).aperture_m - sent.aperture_m) <= tolerance)


COMMAND_CHECKS = (
    check_refuses_before_arm,
    check_refuses_what_is_not_finite,
    check_refuses_what_is_expired,
    check_commands_do_not_block,
)
GRIPPER_CHECKS = (
    *COMMAND_CHECKS,
    check_gripper_sends_within_its_spec,
    check_gripper_reaches_what_was_sent,
    check_gripper_never_opens_on_failure,
    check_gripper_finishes_after_expiry,
)
ARM_CHECKS = (
    *COMMAND_CHECKS,
    check_arm_sends_within_its_spec,
    check_arm_moves_as_sent,
    check_arm_rests_after_expiry,
    check_arm_rests_after_stop,
)
