"""Small devices that keep their contracts, each a view of one world; the mutants are these with one mistake each."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from lsds.contracts import (
    ArmCommand,
    ArmSpec,
    ArmState,
    Frame,
    GripperCommand,
    GripperSpec,
    GripperState,
    Pose,
    PoseSample,
    SensorSpec,
    Twist,
)
from lsds.contracts.lifecycle import LifecycleGuard
from lsds.errors import CommandExpired, ConnectionLost, LimitExceeded
from lsds.testing import gel


class Honest:
    """Life cycle, number and time; `unplug` cuts the line to the world."""

    rate_hz = 100.0

    def __init__(self, options, context):
        self.context = context
        self.clock = context.clock
        self.guard = LifecycleGuard("honest")
        self.connected_ns = 0
        self.unplugged = False

    @property
    def lifecycle(self):
        return self.guard.state

    def connect(self):
        with self.guard.connecting():
            self.connected_ns = self.clock.now()

    def arm(self):
        with self.guard.arming():
            pass

    def stop(self):
        if self.guard.state.value in ("connected", "armed") and not self.unplugged:
            self.halt()

    def halt(self):
        pass

    def disarm(self):
        with self.guard.disarming() as armed:
            if armed:
                self.stop()

    def close(self):
        if self.guard.state.value != "closed":
            self.stop()
        with self.guard.closing():
            pass

    def sampled(self):
        """Return the time and the number of the newest sample."""
        self.guard.require_readable()
        self.require_line()
        seq = int((self.clock.now() - self.connected_ns) * self.rate_hz // 1_000_000_000)
        return self.connected_ns + math.ceil(seq * 1_000_000_000 / self.rate_hz), seq

    def require_line(self):
        if self.unplugged:
            raise ConnectionLost("honest", "the line is cut", remedy="plug it in")

    def accept(self, numbers, expires_ns):
        self.guard.require_armed()
        self.require_line()
        if not all(map(math.isfinite, numbers)):
            raise LimitExceeded("honest", "not finite", remedy="command numbers")
        if expires_ns < self.clock.now():
            raise CommandExpired("honest", "too late", remedy="send a new one")


@cache
def _drawn(seq):
    """Markers, under a red lamp below and a blue one above."""
    drawn = gel.draw(gel.grid_px(), seed=seq).astype(np.float64)
    down = np.linspace(-0.3, 0.3, gel.SPEC.height_px)[:, None]
    drawn[..., 0] *= 1 + down
    drawn[..., 2] *= 1 - down
    return np.clip(drawn, 0, 255).astype(np.uint8)


class HonestSensor(Honest):
    rate_hz = 25.0
    spec = gel.SPEC

    def read(self):
        t_ns, seq = self.sampled()
        return Frame(self.image(seq), t_ns, seq)

    def image(self, seq):
        return _drawn(seq).copy()


class Fingers:
    """The fingers of the world: they go to a target at a speed."""

    def __init__(self, clock):
        self.clock = clock
        self.start_m = self.target_m = 0.05
        self.start_ns, self.speed_m_s = 0, 0.1

    def aperture_m(self):
        way = self.target_m - self.start_m
        gone = self.speed_m_s * (self.clock.now() - self.start_ns) * 1e-9
        return self.start_m + math.copysign(min(abs(way), gone), way)

    def go(self, target_m, speed_m_s):
        self.start_m, self.start_ns = self.aperture_m(), self.clock.now()
        self.target_m, self.speed_m_s = target_m, speed_m_s


class HonestGripper(Honest):
    spec = GripperSpec(stroke_m=0.05, resolution_m=1e-4, speed_m_s=(0.02, 0.15), force_n=(20.0, 130.0))

    def __init__(self, options, context):
        super().__init__(options, context)
        self.fingers = context.shared("fingers", lambda: Fingers(context.clock))

    def halt(self):
        self.fingers.go(self.fingers.aperture_m(), 0.1)

    def read(self):
        t_ns, seq = self.sampled()
        aperture, target = self.fingers.aperture_m(), self.fingers.target_m
        return GripperState(t_ns, seq, aperture, target, moving=aperture != target)

    def command(self, command):
        self.accept((command.aperture_m, command.speed_m_s, command.force_n), command.expires_ns)
        sent = self.limited(command)
        self.fingers.go(sent.aperture_m, sent.speed_m_s)
        return sent

    def limited(self, command):
        spec = self.spec
        aperture = round(min(max(command.aperture_m, 0.0), spec.stroke_m) / spec.resolution_m) * spec.resolution_m
        speed = min(max(command.speed_m_s, spec.speed_m_s[0]), spec.speed_m_s[1])
        force = min(max(command.force_n, spec.force_n[0]), spec.force_n[1])
        return GripperCommand(aperture, speed, force, command.expires_ns)


class Wrist:
    """The TCP of the world: it moves along z, and turns about it, at a velocity until an expiry."""

    STEP_NS = 1_000_000

    def __init__(self, clock):
        self.clock = clock
        self.z_m, self.angle_rad = 0.3, 0.0
        self.speed_m_s, self.wanted_m_s, self.acceleration_m_s2 = 0.0, 0.0, 0.5
        self.rate_rad_s, self.at_ns, self.expires_ns = 0.0, 0, 0

    def advance(self):
        while self.at_ns < self.clock.now():
            step_ns = min(self.STEP_NS, self.clock.now() - self.at_ns)
            self.at_ns += step_ns
            if self.at_ns > self.expires_ns:
                self.wanted_m_s = self.rate_rad_s = 0.0
            change = self.acceleration_m_s2 * step_ns * 1e-9
            self.speed_m_s += min(max(self.wanted_m_s - self.speed_m_s, -change), change)
            self.z_m += self.speed_m_s * step_ns * 1e-9
            self.angle_rad += self.rate_rad_s * step_ns * 1e-9

    def go(self, speed_m_s, expires_ns, acceleration_m_s2=0.5, rate_rad_s=0.0):
        self.advance()
        self.wanted_m_s, self.expires_ns = speed_m_s, expires_ns
        self.acceleration_m_s2, self.rate_rad_s = acceleration_m_s2, rate_rad_s


class HonestArm(Honest):
    spec = ArmSpec(speed_m_s=1.0, acceleration_m_s2=5.0, reach_m=0.85)

    def __init__(self, options, context):
        super().__init__(options, context)
        self.wrist = context.shared("wrist", lambda: Wrist(context.clock))

    def halt(self):
        self.wrist.go(0.0, self.clock.now())

    def read(self):
        t_ns, seq = self.sampled()
        self.wrist.advance()
        return ArmState(t_ns, seq, self.pose(), Twist((0.0, 0.0, self.wrist.speed_m_s)))

    def pose(self):
        half = self.wrist.angle_rad / 2
        return Pose((0.4, 0.0, self.wrist.z_m), (0.0, 0.0, math.sin(half), math.cos(half)))

    def command(self, command):
        numbers = (*command.twist.linear_m_s, *command.twist.angular_rad_s, command.acceleration_m_s2)
        self.accept(numbers, command.expires_ns)
        sent = self.limited(command)
        self.move(sent)
        return sent

    def move(self, sent):
        self.wrist.go(sent.twist.linear_m_s[2], sent.expires_ns, sent.acceleration_m_s2, sent.twist.angular_rad_s[2])

    def limited(self, command):
        limit = self.spec.speed_m_s
        speed = min(max(command.twist.linear_m_s[2], -limit), limit)
        acceleration = min(command.acceleration_m_s2, self.spec.acceleration_m_s2)
        twist = Twist((0.0, 0.0, speed), (0.0, 0.0, command.twist.angular_rad_s[2]))
        return ArmCommand(twist, acceleration, command.expires_ns)


class HonestPoses(Honest):
    rate_hz = 60.0

    def read(self):
        t_ns, seq = self.sampled()
        return PoseSample(t_ns, seq, {"object": self.pose()})

    def pose(self):
        return Pose((0.4, 0.0, 0.1))


def small(**changes):
    """Return the spec of the honest sensor with other values."""
    fields = {name: getattr(gel.SPEC, name) for name in SensorSpec.__slots__}
    return SensorSpec(**fields | changes)
