"""Checks of moving devices: grippers and arms. They run on real hardware only with permission."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

from lsds.contracts.devices import Gripper, Lifecycle
from lsds.contracts.values import ArmCommand, Contact, GripperCommand, Twist
from lsds.errors import CommandExpired, LifecycleError, LimitExceeded
from lsds.testing.bench import Bench
from lsds.testing.connecting import tolerance_m
from lsds.testing.expect import assert_raises
from lsds.testing.machine import a_command
from lsds.testing.outcomes import NotApplicable

_SOON_S = 0.2
"""An expiry long enough for a driver on a busy machine, and shorter than a slow motion."""
_SMALL_STEPS = 5
"""Steps of the resolution that a gripper has to make; chosen above the tolerance of two steps."""
_SMALL_M = 5e-4
"""Least such motion, m: above the tolerance of a gripper with a very fine resolution."""
_RAMP_M_S = 0.05
"""Speed to which an arm is accelerated, m/s; chosen."""
_RAMP_M_S2 = 0.1
"""Acceleration of that, m/s^2: it takes half a second."""
_TURN_RAD_S = 0.1
"""Rate at which an arm turns, rad/s; chosen."""
_TURN_STEPS = 100
"""Number of commands, one every 10 ms, in which it takes up that rate, and in which it is measured; chosen."""
_LEAST_TURN_RAD_S = 1e-3
"""Rate below which an arm does not turn, rad/s; chosen."""


def check_refuses_before_arm(bench: Bench) -> None:
    """A device that is connected but not armed refuses commands."""
    with bench.device() as device:
        command = a_command(bench, bench.in_future())
        assert_raises(lambda: device.command(command), LifecycleError, "command() before arm()")


def check_refuses_what_is_not_finite(bench: Bench) -> None:
    """NaN and infinity in any field raise LimitExceeded."""
    with bench.device(Lifecycle.ARMED) as device:
        good = a_command(bench, bench.in_future(60.0))
        for bad in (math.nan, math.inf, -math.inf):
            if bench.kind == "gripper":
                commands = [replace(good, **{field: bad}) for field in ("aperture_m", "speed_m_s", "force_n")]
            else:
                twists = (Twist((bad, 0.0, 0.0)), Twist(good.twist.linear_m_s, (0.0, 0.0, bad)))
                commands = [*(replace(good, twist=twist) for twist in twists), replace(good, acceleration_m_s2=bad)]
            for command in commands:
                assert_raises(partial(device.command, command), LimitExceeded, f"command({command})")


def check_refuses_what_is_expired(bench: Bench) -> None:
    """A command received after its expiry is not executed."""
    with bench.device(Lifecycle.ARMED) as device:
        bench.advance(0.01)
        late = a_command(bench, bench.clock.now() - 1)
        assert_raises(lambda: device.command(late), CommandExpired, "command() 1 ns after its expiry")


def check_gripper_sends_within_its_spec(bench: Bench) -> None:
    """The returned command is the one sent: within the declared ranges, and close to the requested one if possible."""
    with bench.device(Lifecycle.ARMED) as gripper:
        spec = gripper.spec
        for aperture, speed, force in [
            (spec.stroke_m / 2, sum(spec.speed_m_s) / 2, sum(spec.force_n) / 2),
            (spec.stroke_m * 5, spec.speed_m_s[1] * 5, spec.force_n[1] * 5),
            (-0.01, 0.0, 0.0),
        ]:
            wish = GripperCommand(aperture, speed, force, bench.in_future())
            sent = gripper.command(wish)
            asked = f"command({aperture} m, {speed} m/s, {force} N) returned {sent}"
            _assert_same_expiry(wish, sent)
            assert -1e-9 <= sent.aperture_m <= spec.stroke_m + spec.resolution_m, (
                f"{asked}: its aperture is outside of 0 to {spec.stroke_m} m; return what was sent, after limits"
            )
            for name in ("speed_m_s", "force_n"):
                low, high = getattr(spec, name)
                assert low * 0.999 <= getattr(sent, name) <= high * 1.001, (
                    f"{asked}: its {name} is outside of the spec, {low} to {high}; return what was sent, after limits"
                )
            wanted = min(max(aperture, 0.0), spec.stroke_m)
            assert abs(sent.aperture_m - wanted) <= spec.resolution_m * 1.01, (
                f"{asked}: its aperture is not the nearest to {wanted} m at a resolution of {spec.resolution_m} m"
            )


def check_gripper_reaches_what_was_sent(bench: Bench) -> None:
    """The empty gripper moves to the aperture that `command` returned, and stays there."""
    with bench.device(Lifecycle.ARMED) as gripper:
        spec = gripper.spec
        sent = gripper.command(
            GripperCommand(spec.stroke_m * 0.8, spec.speed_m_s[1], spec.force_n[1], bench.in_future())
        )

        def arrived() -> bool:
            return _is_at(bench, gripper, sent)

        there = bench.settle(arrived, 5.0)
        ended_m = bench.read(gripper).aperture_m
        reversed_ = abs(ended_m - (spec.stroke_m - sent.aperture_m)) <= tolerance_m(gripper)
        remedy = "its apertures are reversed: 0 is closed" if reversed_ else "return the aperture that was sent"
        assert there, f"the gripper is at {ended_m} m 5 s after it was sent to {sent.aperture_m} m; {remedy}"
        bench.advance(0.5)
        assert arrived(), (
            f"the gripper went from its target {sent.aperture_m} m to {bench.read(gripper).aperture_m} m; "
            "hold the target"
        )
        contact = bench.read(gripper).contact
        assert contact is not Contact.CLOSING, (
            f"contact is closing at rest at {sent.aperture_m} m in the air; report an object only while the fingers "
            "press one"
        )


def check_gripper_makes_small_steps(bench: Bench) -> None:
    """A command that differs by a few steps of the declared resolution moves the fingers by that much."""
    with bench.device(Lifecycle.ARMED) as gripper:
        spec = gripper.spec
        aperture = spec.stroke_m * 0.8
        for change in (0.0, -max(_SMALL_STEPS * spec.resolution_m, _SMALL_M)):
            aperture += change
            sent = gripper.command(GripperCommand(aperture, spec.speed_m_s[1], spec.force_n[1], bench.in_future()))
            arrived = bench.settle(partial(_is_at, bench, gripper, sent), 5.0)
            way = f", {abs(change) * 1e3:.2f} mm away" if change else ""
            assert arrived, (
                f"the gripper is at {bench.read(gripper).aperture_m} m 5 s after it was sent to {sent.aperture_m} m"
                f"{way}; move by every step of the declared resolution, {spec.resolution_m} m"
            )


def check_gripper_follows_a_newer_command(bench: Bench) -> None:
    """A command that comes during a motion replaces it."""
    with bench.device(Lifecycle.ARMED) as gripper:
        spec = gripper.spec
        wide = GripperCommand(spec.stroke_m * 0.9, spec.speed_m_s[1], spec.force_n[0], bench.in_future(10.0))
        bench.settle(partial(_is_at, bench, gripper, gripper.command(wide)), 5.0)
        gripper.command(replace(wide, aperture_m=0.0, speed_m_s=spec.speed_m_s[0], expires_ns=bench.in_future(10.0)))
        bench.advance(_SOON_S)
        sent = gripper.command(replace(wide, expires_ns=bench.in_future(10.0)))
        bench.advance(_SOON_S)
        assert bench.settle(partial(_is_at, bench, gripper, sent), 5.0), (
            f"sent back to {sent.aperture_m} m while it closed, the gripper is at {bench.read(gripper).aperture_m} m "
            "5 s later; carry out the newest command, also during a motion"
        )


def check_gripper_never_opens_on_failure(bench: Bench) -> None:
    """Refused and expired commands, an expiry during motion, stop and disarm do not open the gripper."""
    with bench.device(Lifecycle.ARMED) as gripper:
        spec = gripper.spec
        sent = gripper.command(
            GripperCommand(spec.stroke_m * 0.5, spec.speed_m_s[1], spec.force_n[1], bench.in_future(_SOON_S))
        )
        there = bench.settle(partial(_is_at, bench, gripper, sent), 3.0 + 2 * spec.stroke_m / spec.speed_m_s[1])
        assert there, f"the gripper does not reach {sent.aperture_m} m; move to the aperture that is returned"
        bench.advance(0.5)
        held = bench.read(gripper).aperture_m

        def assert_holds(when: str) -> None:
            bench.advance(0.5)
            now_m = bench.read(gripper).aperture_m
            assert now_m <= held + tolerance_m(gripper), (
                f"the gripper opened from {held} to {now_m} m at {when}; never open but by a command"
            )

        wide = GripperCommand(spec.stroke_m, spec.speed_m_s[1], spec.force_n[1], bench.in_future())
        assert_raises(lambda: gripper.command(replace(wide, force_n=math.nan)), LimitExceeded, "command(force_n=nan)")
        assert_holds("a refused command")
        late = replace(wide, expires_ns=bench.clock.now() - 1)
        assert_raises(lambda: gripper.command(late), CommandExpired, "command() 1 ns after its expiry")
        assert_holds("an expired command")
        for end in (gripper.stop, gripper.disarm):
            end()
            assert_holds(f"{end.__name__}()")


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
            f"stopped at {bench.read(gripper).aperture_m} m on the way from {start} to {sent.aperture_m} m, "
            "at the expiry of the command; let a motion that has begun go on"
        )


def check_arm_sends_within_its_spec(bench: Bench) -> None:
    """The returned command is the one sent, within the declared speed and acceleration."""
    with bench.device(Lifecycle.ARMED) as arm:
        spec = arm.spec
        # A real arm is not sent down: a table may be there.
        for direction in (1, -1) if bench.virtual else (1,):
            asked = ArmCommand(
                Twist((0.0, 0.0, direction * spec.speed_m_s * 5)), spec.acceleration_m_s2 * 5, bench.in_future(_SOON_S)
            )
            sent = arm.command(asked)
            _assert_same_expiry(asked, sent)
            speed, acceleration = math.hypot(*sent.twist.linear_m_s), sent.acceleration_m_s2
            assert speed <= spec.speed_m_s * 1.001, (
                f"{asked} returned {speed} m/s, and the spec allows {spec.speed_m_s} m/s; return what was sent"
            )
            assert acceleration <= spec.acceleration_m_s2 * 1.001, (
                f"{asked} returned {acceleration} m/s2, and the spec allows {spec.acceleration_m_s2}; "
                "return what was sent"
            )
            arm.stop()
            bench.advance(1.0)


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
        shown = end.tcp_twist.linear_m_s[2]
        assert abs(shown - wanted) <= 0.1 * wanted, f"tcp_twist is {shown} m/s along z at {wanted} m/s; report m/s"
        assert 0.7 * due <= moved <= 1.1 * due, (
            f"the arm moved {moved} m along z, and {due} m are due at {wanted} m/s; return the velocity that was sent"
        )


def check_arm_accelerates_as_sent(bench: Bench) -> None:
    """The arm takes up speed with the acceleration that `command` returned, not in a jerk."""
    with bench.device(Lifecycle.ARMED) as arm:
        asked = ArmCommand(Twist((0.0, 0.0, _RAMP_M_S)), _RAMP_M_S2, bench.in_future(10.0))
        sent = arm.command(asked)
        wanted, ramp_s = sent.twist.linear_m_s[2], sent.twist.linear_m_s[2] / sent.acceleration_m_s2
        slow = fast = None
        for state in bench.samples(arm, ramp_s + 1.0):
            speed = state.tcp_twist.linear_m_s[2]
            slow = state.t_ns if speed < 0.1 * wanted else slow
            if speed > 0.9 * wanted:
                fast = state.t_ns
                break
        arm.stop()
        if slow is None or fast is None:
            return  # `check_arm_moves_as_sent` reports an arm that does not move.
        took_s = (fast - slow) * 1e-9
        assert took_s > 0.4 * ramp_s, (
            f"the arm took up {wanted} m/s in {took_s:.3f} s, and {0.8 * ramp_s:.3f} s are due at "
            f"{sent.acceleration_m_s2} m/s2; send the acceleration that is returned"
        )


def check_arm_turns_as_sent(bench: Bench) -> None:
    """While commands are renewed, the arm turns at the rate that `command` returned."""
    with bench.device(Lifecycle.ARMED) as arm:
        axis = _turns_about(bench, arm)
        start, wanted = bench.read(arm), math.nan
        for step in range(2 * _TURN_STEPS):
            # The first half is for the arm to take up the rate.
            start = bench.read(arm) if step == _TURN_STEPS else start
            wanted = arm.command(_turn(bench, axis)).twist.angular_rad_s[axis]
            bench.advance(0.01)
        end = bench.read(arm)
        arm.stop()
        due = wanted * (end.t_ns - start.t_ns) * 1e-9
        same = sum(a * b for a, b in zip(start.tcp_pose.quaternion_xyzw, end.tcp_pose.quaternion_xyzw, strict=True))
        turned = 2 * math.acos(min(abs(same), 1.0))
        assert 0.6 * due <= turned <= 1.2 * due, (
            f"the arm turned by {turned:.4f} rad, and {due:.4f} rad are due at {wanted} rad/s; return the rate that "
            "was sent, and raise LimitExceeded if the arm cannot turn"
        )


def _turns_about(bench: Bench, arm: Any) -> int:
    """Return an axis about which the arm turns, z or y. Raises NotApplicable for an arm that turns about neither."""
    for axis in (2, 1):
        try:
            sent = arm.command(_turn(bench, axis))
        except LimitExceeded:
            continue
        if abs(sent.twist.angular_rad_s[axis]) > _LEAST_TURN_RAD_S:
            return axis
    raise NotApplicable("the arm turns about neither z nor y")


def _turn(bench: Bench, axis: int) -> ArmCommand:
    rate = [0.0, 0.0, 0.0]
    rate[axis] = _TURN_RAD_S
    return ArmCommand(Twist((0.0, 0.0, 0.0), (rate[0], rate[1], rate[2])), 0.5, bench.in_future(0.1))


def check_arm_obeys_the_newest_expiry(bench: Bench) -> None:
    """The expiry of a command that was replaced does not stop the newer one."""
    with bench.device(Lifecycle.ARMED) as arm:
        arm.command(a_command(bench, bench.in_future(_SOON_S)))
        bench.advance(0.05)
        wanted = arm.command(a_command(bench, bench.in_future(10.0))).twist.linear_m_s[2]
        bench.advance(_SOON_S + 0.5)
        speed = bench.read(arm).tcp_twist.linear_m_s[2]
        arm.stop()
        assert speed > 0.5 * wanted, (
            f"the arm moves at {speed} m/s, and {wanted} m/s were sent for 10 s; forget the expiry of the command "
            "before"
        )


def check_arm_rests_after_expiry(bench: Bench) -> None:
    """Without a newer command the arm decelerates to rest after the expiry, and reports it."""
    with bench.device(Lifecycle.ARMED) as arm:
        command = a_command(bench, bench.in_future(0.1))
        sent = arm.command(command)
        bench.advance(0.09)
        speed = math.hypot(*sent.twist.linear_m_s)
        bench.advance(0.01 + speed / command.acceleration_m_s2 + 0.25)
        rest = bench.read(arm)
        assert math.hypot(*rest.tcp_twist.linear_m_s) < 1e-3, (
            f"the arm is still moving, with {rest.tcp_twist.linear_m_s} m/s, after expiry and deceleration; "
            "stop it in the driver"
        )
        bench.advance(0.5)
        drift = math.dist(bench.read(arm).tcp_pose.position_m, rest.tcp_pose.position_m)
        assert drift < 5e-4, f"the arm drifted {drift} m in 0.5 s at rest; decelerate it to rest at the expiry"


def check_arm_rests_after_stop(bench: Bench) -> None:
    """`stop` brings a moving arm to rest."""
    with bench.device(Lifecycle.ARMED) as arm:
        arm.command(a_command(bench, bench.in_future(10.0)))
        bench.advance(0.2)
        arm.stop()
        bench.advance(1.0)
        speed = math.hypot(*bench.read(arm).tcp_twist.linear_m_s)
        assert speed < 1e-3, f"the arm still moves with {speed} m/s, 1 s after stop(); end the motion in stop()"
        # A command that is still under way must not start it again.
        arm.command(a_command(bench, bench.in_future(10.0)))
        arm.stop()
        bench.advance(1.0)
        speed = math.hypot(*bench.read(arm).tcp_twist.linear_m_s)
        assert speed < 1e-3, (
            f"the arm moves with {speed} m/s, 1 s after a command and stop() right behind it; let stop() end what is "
            "under way, too"
        )


def _assert_same_expiry(asked: GripperCommand | ArmCommand, sent: GripperCommand | ArmCommand) -> None:
    assert sent.expires_ns == asked.expires_ns, (
        f"a command that expires at {asked.expires_ns} ns came back with {sent.expires_ns} ns; keep its expires_ns"
    )


def _is_at(bench: Bench, gripper: Gripper, sent: GripperCommand) -> bool:
    tolerance = 2 * gripper.spec.resolution_m + 1e-4
    return bool(abs(bench.read(gripper).aperture_m - sent.aperture_m) <= tolerance)


COMMAND_CHECKS = (
    check_refuses_before_arm,
    check_refuses_what_is_not_finite,
    check_refuses_what_is_expired,
)
GRIPPER_CHECKS = (
    *COMMAND_CHECKS,
    check_gripper_sends_within_its_spec,
    check_gripper_reaches_what_was_sent,
    check_gripper_makes_small_steps,
    check_gripper_follows_a_newer_command,
    check_gripper_never_opens_on_failure,
    check_gripper_finishes_after_expiry,
)
ARM_CHECKS = (
    *COMMAND_CHECKS,
    check_arm_sends_within_its_spec,
    check_arm_moves_as_sent,
    check_arm_accelerates_as_sent,
    check_arm_turns_as_sent,
    check_arm_obeys_the_newest_expiry,
    check_arm_rests_after_expiry,
    check_arm_rests_after_stop,
)
