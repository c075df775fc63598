"""Grippers and arms with a mistake in a motion, report or declaration."""

from __future__ import annotations

import math
from dataclasses import replace

from catching import caught_device
from honest_devices import HonestArm, HonestGripper

from lsds.contracts import ArmSpec, Contact, Pose, Twist
from lsds.errors import LsdsError
from lsds.testing import arm_state, connecting, gripper_state, motion, specs, stamps, unplugged

CONNECTS = connecting.check_connect_moves_nothing
CLOSES = connecting.check_close_ends_motion
REPORTS = gripper_state.check_gripper_reports_its_motion
SENDS = motion.check_gripper_sends_within_its_spec
SPEC = specs.check_spec_is_sound


@caught_device("gripper", CONNECTS, r"after connect\(\) the device has moved by .* mm")
class ClosesInConnect(HonestGripper):
    def connect(self):
        super().connect()
        self.fingers.go(0.0, 0.1)


@caught_device("gripper", CONNECTS, r"after connect\(\) of a second device the device has moved by")
class OpensInConnect(HonestGripper):
    def connect(self):
        super().connect()
        self.fingers.go(0.05, 0.1)


@caught_device("arm", CONNECTS, r"after connect\(\) the device has moved by")
class HomesInConnect(HonestArm):
    def connect(self):
        super().connect()
        self.wrist.go(0.1, self.clock.now() + 10**9)


@caught_device("gripper", CLOSES, r"close\(\) opened the gripper")
class OpensOnClose(HonestGripper):
    def close(self):
        if self.lifecycle.value != "closed":
            super().close()
            self.fingers.go(0.05, 0.1)


@caught_device("gripper", CLOSES, r"after close\(\) the device has moved on")
class ClosesOnAndOn(HonestGripper):
    def close(self):
        with self.guard.closing():
            pass


@caught_device("arm", CLOSES, r"after close\(\) the device has moved on")
class RisesAfterClose(HonestArm):
    def close(self):
        with self.guard.closing():
            pass


@caught_device("gripper", unplugged.check_unplugged_gripper_holds, r"opened from .* at read\(\)")
class OpensWhenUnplugged(HonestGripper):
    def require_line(self):
        if self.unplugged:
            self.fingers.go(0.05, 0.1)
        super().require_line()


@caught_device("gripper", motion.check_gripper_never_opens_on_failure, r"opened from .* at disarm\(\)")
class OpensOnDisarm(HonestGripper):
    def disarm(self):
        super().disarm()
        self.fingers.go(0.05, 0.1)


@caught_device("gripper", motion.check_gripper_never_opens_on_failure, r"opened from .* at stop\(\)")
class OpensOnStop(HonestGripper):
    def halt(self):
        self.fingers.go(0.05, 0.1)


@caught_device("gripper", motion.check_gripper_never_opens_on_failure, "opened from .* at a refused command")
class OpensOnARefusalUntilItIsStopped(HonestGripper):
    def accept(self, numbers, expires_ns):
        try:
            super().accept(numbers, expires_ns)
        except LsdsError:
            self.fingers.go(0.05, 0.1)
            raise


@caught_device("gripper", motion.check_gripper_never_opens_on_failure, "opened from")
class OpensOnARefusal(OpensOnARefusalUntilItIsStopped):
    def stop(self):
        """Leave the fingers alone: the opening must not be hidden by it."""


@caught_device("gripper", motion.check_gripper_makes_small_steps, "0.50 mm away; move by every step")
class IgnoresSmallSteps(HonestGripper):
    def command(self, command):
        before = self.fingers.target_m, self.fingers.speed_m_s
        sent = super().command(command)
        if abs(sent.aperture_m - self.fingers.aperture_m()) < 2e-3:
            self.fingers.go(*before)
        return sent


@caught_device("gripper", motion.check_gripper_follows_a_newer_command, "carry out the newest command, also during")
class FinishesEveryMotion(HonestGripper):
    def command(self, command):
        busy = self.fingers.aperture_m() != self.fingers.target_m
        target, speed = self.fingers.target_m, self.fingers.speed_m_s
        sent = super().command(command)
        if busy:
            self.fingers.go(target, speed)
        return sent


class LateGripper(HonestGripper):
    """Starts a motion 10 ms after its command, as over a line."""

    def command(self, command):
        here = self.fingers.aperture_m()
        sent = super().command(command)
        self.due = self.clock.now() + 10_000_000, sent
        self.fingers.go(here, 0.1)
        return sent

    def begin(self):
        due = getattr(self, "due", None)
        if due is not None and self.clock.now() >= due[0]:
            self.due = None
            self.fingers.go(due[1].aperture_m, due[1].speed_m_s)

    def read(self):
        self.begin()
        return super().read()

    def halt(self):
        self.begin()
        super().halt()


@caught_device("gripper", gripper_state.check_gripper_stops, r"stop\(\) right behind it the fingers move from")
class StartsAfterStop(LateGripper):
    pass


@caught_device("gripper", SENDS, "came back with .* ns; keep its expires_ns")
class ProlongsCommands(HonestGripper):
    def command(self, command):
        sent = super().command(command)
        return replace(sent, expires_ns=sent.expires_ns + 60 * 10**9)


@caught_device("gripper", REPORTS, "moving is false at .* on the way to")
class ReportsArrivalEarly(HonestGripper):
    def read(self):
        state = super().read()
        return replace(state, moving=state.moving and abs(state.aperture_m - state.target_m) > 5e-3)


@caught_device("gripper", REPORTS, "contact is closing at .* while the fingers move in the air")
class FeelsItsOwnMotion(HonestGripper):
    def read(self):
        state = super().read()
        return replace(state, contact=Contact.CLOSING if state.moving else Contact.NONE)


@caught_device("gripper", motion.check_gripper_reaches_what_was_sent, "contact is closing at rest at 0.04 m in the air")
class FeelsAnObjectWhenNotOpen(HonestGripper):
    def read(self):
        state = super().read()
        shut = not state.moving and state.aperture_m < 0.045
        return replace(state, contact=Contact.CLOSING if shut else Contact.NONE)


@caught_device("gripper", REPORTS, "move at the speed that is returned")
class AlwaysAtFullSpeed(HonestGripper):
    def command(self, command):
        sent = super().command(command)
        self.fingers.go(sent.aperture_m, self.spec.speed_m_s[1])
        return sent


@caught_device("gripper", stamps.check_number_and_time_go_up_together, "a sequence number went back")
class CountsInOneByte(HonestGripper):
    def sampled(self):
        t_ns, seq = super().sampled()
        return t_ns, seq % 256


@caught_device("gripper", REPORTS, "moving is true in 0 of")
class NeverMoving(HonestGripper):
    def read(self):
        return replace(super().read(), moving=False)


@caught_device("gripper", REPORTS, "moving is true at rest")
class AlwaysMoving(HonestGripper):
    def read(self):
        return replace(super().read(), moving=True)


@caught_device("gripper", REPORTS, "target_m is 0.05 m while the fingers move to 0.035")
class FalseTarget(HonestGripper):
    def read(self):
        return replace(super().read(), target_m=0.05)


@caught_device("gripper", REPORTS, "target_m is 0.04.* m while the fingers move to")
class TargetIsAperture(HonestGripper):
    def read(self):
        state = super().read()
        return replace(state, target_m=state.aperture_m)


@caught_device("gripper", REPORTS, "contact is closing at rest at 0.05 m, after it was opened")
class AlwaysFeelsAnObject(HonestGripper):
    def read(self):
        return replace(super().read(), contact=Contact.CLOSING)


@caught_device("gripper", REPORTS, r"moves at 0.02\d* m/s after command\(\) returned 0.15 m/s")
class IgnoresTheSpeed(HonestGripper):
    def command(self, command):
        sent = super().command(command)
        self.fingers.go(sent.aperture_m, 0.02)
        return sent


@caught_device("gripper", gripper_state.check_gripper_state_is_sound, "aperture_m is 50.0, outside of the stroke")
class ApertureInMillimetres(HonestGripper):
    def read(self):
        state = super().read()
        return replace(state, aperture_m=state.aperture_m * 1000)


@caught_device("gripper", gripper_state.check_gripper_state_is_sound, "target_m is nan")
class UnknownTargetIsNan(HonestGripper):
    def read(self):
        return replace(super().read(), target_m=math.nan)


@caught_device("gripper", gripper_state.check_gripper_stops, r"the fingers move on after stop\(\)")
class StopDoesNothing(HonestGripper):
    def stop(self):
        pass


@caught_device("gripper", motion.check_refuses_what_is_expired, "1 ns after its expiry did not raise CommandExpired")
class IgnoresExpiry(HonestGripper):
    def accept(self, numbers, expires_ns):
        super().accept(numbers, max(expires_ns, self.clock.now()))


@caught_device("gripper", motion.check_refuses_what_is_not_finite, "did not raise LimitExceeded")
class TakesNan(HonestGripper):
    def accept(self, numbers, expires_ns):
        super().accept((0.0,), expires_ns)

    def limited(self, command):
        return command


@caught_device("gripper", motion.check_refuses_before_arm, r"command\(\) before arm\(\) did not raise LifecycleError")
class TakesCommandsUnarmed(HonestGripper):
    def accept(self, numbers, expires_ns):
        if self.lifecycle.value == "armed":
            super().accept(numbers, expires_ns)


@caught_device("gripper", SENDS, r"its aperture is outside of 0 to 0.05 m")
class ReturnsTheWanted(HonestGripper):
    def command(self, command):
        super().command(command)
        return command


@caught_device("gripper", SENDS, "its force_n is outside of the spec")
class ForceBeyondTheSpec(HonestGripper):
    def limited(self, command):
        return replace(super().limited(command), force_n=command.force_n)


@caught_device("gripper", SENDS, "its speed_m_s is outside of the spec")
class SpeedBeyondTheSpec(HonestGripper):
    def limited(self, command):
        return replace(super().limited(command), speed_m_s=command.speed_m_s)


@caught_device("gripper", SENDS, "is not the nearest to 0.025 m")
class CoarserThanDeclared(HonestGripper):
    def limited(self, command):
        sent = super().limited(command)
        return replace(sent, aperture_m=round(sent.aperture_m / 0.002) * 0.002)


@caught_device("gripper", motion.check_gripper_reaches_what_was_sent, "5 s after it was sent to")
class GoesElsewhere(HonestGripper):
    def command(self, command):
        sent = super().command(command)
        self.fingers.go(sent.aperture_m * 0.8, sent.speed_m_s)
        return sent


@caught_device("gripper", motion.check_gripper_reaches_what_was_sent, "its apertures are reversed: 0 is closed")
class MovesTheOtherWay(HonestGripper):
    def command(self, command):
        sent = super().command(command)
        self.fingers.go(self.spec.stroke_m - sent.aperture_m, sent.speed_m_s)
        return sent


@caught_device("gripper", motion.check_gripper_finishes_after_expiry, "at the expiry of the command")
class HaltsAtExpiry(HonestGripper):
    def command(self, command):
        self.expires_ns = command.expires_ns
        return super().command(command)

    def read(self):
        if self.clock.now() > getattr(self, "expires_ns", math.inf):
            self.halt()
        return super().read()


@caught_device("gripper", SPEC, r"speed_m_s is \(0.15, 0.02\)")
class InvertedRange(HonestGripper):
    spec = replace(HonestGripper.spec, speed_m_s=(0.15, 0.02))


@caught_device("gripper", SPEC, "force_n is .*nan")
class UnknownForce(HonestGripper):
    spec = replace(HonestGripper.spec, force_n=(20.0, math.nan))


@caught_device("gripper", SPEC, "resolution_m is 0")
class NoResolution(HonestGripper):
    spec = replace(HonestGripper.spec, resolution_m=0.0)


@caught_device("gripper", SPEC, "stroke_m is 50")
class StrokeInMillimetres(HonestGripper):
    spec = replace(HonestGripper.spec, stroke_m=50.0)


@caught_device("arm", SPEC, "reach_m is 850")
class ReachInMillimetres(HonestArm):
    spec = ArmSpec(1.0, 5.0, 850.0)


@caught_device("arm", arm_state.check_arm_state_is_sound, "of length 7, not 1")
class LongTcpQuaternion(HonestArm):
    def pose(self):
        return Pose(super().pose().position_m, (0.0, 0.0, 0.0, 7.0))


@caught_device("arm", arm_state.check_arm_state_is_sound, "500 m away, and at most")
class TcpInMillimetres(HonestArm):
    def pose(self):
        return Pose(tuple(1000 * place for place in super().pose().position_m))


@caught_device("arm", arm_state.check_arm_rests_until_commanded, "without a command")
class MovesWhenArmed(HonestArm):
    def arm(self):
        super().arm()
        self.wrist.go(0.1, self.clock.now() + 10**10)


@caught_device("arm", arm_state.check_arm_rests_after_disarm, r"after disarm\(\)")
class MovesAfterDisarm(HonestArm):
    def disarm(self):
        with self.guard.disarming():
            pass


@caught_device("arm", motion.check_arm_moves_as_sent, "tcp_twist is 0")
class NoTwist(HonestArm):
    def read(self):
        return replace(super().read(), tcp_twist=Twist())


@caught_device("arm", motion.check_arm_moves_as_sent, "the arm moved .* m along z")
class MovesDown(HonestArm):
    def pose(self):
        return Pose((0.4, 0.0, 0.6 - self.wrist.z_m))


@caught_device("arm", motion.check_refuses_what_is_not_finite, "did not raise LimitExceeded")
class TakesANanTurn(HonestArm):
    def command(self, command):
        turns = math.isfinite(command.twist.angular_rad_s[2])
        return super().command(command if turns else replace(command, twist=Twist(command.twist.linear_m_s)))


@caught_device("arm", motion.check_arm_accelerates_as_sent, "send the acceleration that is returned")
class Jerks(HonestArm):
    def move(self, sent):
        super().move(replace(sent, acceleration_m_s2=50.0))


@caught_device("arm", motion.check_arm_turns_as_sent, "return the rate that was sent")
class TurnsInDegrees(HonestArm):
    def move(self, sent):
        super().move(replace(sent, twist=Twist(sent.twist.linear_m_s, (0.0, 0.0, 57.3 * sent.twist.angular_rad_s[2]))))


@caught_device("arm", motion.check_arm_obeys_the_newest_expiry, "forget the expiry of the command before")
class KeepsTheFirstExpiry(HonestArm):
    def move(self, sent):
        first = self.wrist.expires_ns if self.wrist.expires_ns > self.clock.now() else sent.expires_ns
        super().move(replace(sent, expires_ns=min(first, sent.expires_ns)))


@caught_device("arm", motion.check_arm_rests_after_stop, r"1 s after a command and stop\(\) right behind it")
class GoesOnWithWhatIsUnderWay(HonestArm):
    def move(self, sent):
        super().move(sent)
        self.sent, self.sent_ns = sent, self.clock.now()

    def halt(self):
        super().halt()
        if self.clock.now() == getattr(self, "sent_ns", -1):
            super().move(self.sent)


@caught_device("arm", motion.check_arm_rests_after_expiry, "still moving")
class RunsAway(HonestArm):
    def command(self, command):
        sent = super().command(command)
        self.wrist.expires_ns += 10**12
        return sent


@caught_device("arm", motion.check_arm_rests_after_stop, r"1 s after stop\(\)")
class ArmIgnoresStop(HonestArm):
    def stop(self):
        pass


@caught_device("arm", motion.check_arm_sends_within_its_spec, "the spec allows 1.0 m/s")
class LimitsUpwardOnly(HonestArm):
    def limited(self, command):
        speed = min(command.twist.linear_m_s[2], self.spec.speed_m_s)
        return replace(super().limited(command), twist=Twist((0.0, 0.0, speed)))


@caught_device("arm", motion.check_arm_sends_within_its_spec, r"25.0 m/s2, and the spec allows 5.0")
class AcceleratesBeyondTheSpec(HonestArm):
    def limited(self, command):
        return replace(super().limited(command), acceleration_m_s2=command.acceleration_m_s2)
