"""Devices and a cell with known behaviour, for a fault to wrap. Each logs the calls that reach it."""

from __future__ import annotations

import math
from typing import Any

from lsds.clock import Clock, seconds
from lsds.contracts import (
    ArmCommand,
    ArmState,
    Frame,
    GripperCommand,
    GripperState,
    Lifecycle,
    Pose,
    PoseSample,
    Twist,
)
from lsds.testing.exact import exact
from lsds.testing.gel import SPEC
from lsds.testing.situations import ARM, GRIPPER, QuietCell
from lsds.testing.stimulus import FRAME_NS, frames, rest_frame

SAMPLE_NS = 8_000_000
"""Interval of the samples of gripper, arm and pose source."""


class Part:
    """Base of all parts. `log` holds the calls that reached the part, as (time in s, name, arguments)."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.log: list[tuple[float, str, Any]] = []

    def note(self, name: str, *arguments: Any) -> None:
        """Log a call."""
        self.log.append((seconds(self.clock.now()), name, exact(arguments)))


class KnownDevice(Part):
    """The life cycle of a device that never fails."""

    def __init__(self, clock: Clock) -> None:
        super().__init__(clock)
        self.lifecycle = Lifecycle.NEW

    def connect(self) -> None:
        """Become connected."""
        self.note("connect")
        self.lifecycle = Lifecycle.CONNECTED

    def arm(self) -> None:
        """Become armed."""
        self.note("arm")
        self.lifecycle = Lifecycle.ARMED

    def stop(self) -> None:
        """End motion."""
        self.note("stop")

    def disarm(self) -> None:
        """Become connected again."""
        self.note("disarm")
        self.lifecycle = Lifecycle.CONNECTED

    def close(self) -> None:
        """Become closed."""
        self.note("close")
        self.lifecycle = Lifecycle.CLOSED


class KnownSensor(KnownDevice):
    """A sensor that returns the frames of the kit, each with its own writable array."""

    spec = SPEC

    def __init__(self, clock: Clock) -> None:
        super().__init__(clock)
        self._newest: Frame | None = None

    def read(self) -> Frame:
        """Return the newest frame."""
        seq = self.clock.now() // FRAME_NS
        if self._newest is None or self._newest.seq != seq:
            drawn = (rest_frame(), *frames("slides"), *frames("turns"))
            image = drawn[seq % len(drawn)].image.copy()
            self._newest = Frame(image, seq * FRAME_NS, seq)
        return self._newest


class KnownGripper(KnownDevice):
    """A gripper that follows its commands."""

    spec = GRIPPER

    def __init__(self, clock: Clock) -> None:
        super().__init__(clock)
        self._from_m = self._target_m = GRIPPER.stroke_m
        self._since_ns, self._speed_m_s = 0, 0.0

    def read(self) -> GripperState:
        """Return the newest state."""
        seq = self.clock.now() // SAMPLE_NS
        aperture_m = self._at(seq * SAMPLE_NS)
        return GripperState(seq * SAMPLE_NS, seq, aperture_m, self._target_m, aperture_m != self._target_m)

    def command(self, command: GripperCommand) -> GripperCommand:
        """Follow a command."""
        self.note("command", command)
        now = self.clock.now()
        self._from_m, self._since_ns = self._at(now), now
        self._target_m, self._speed_m_s = command.aperture_m, command.speed_m_s
        return command

    def stop(self) -> None:
        """Stand still."""
        super().stop()
        self._from_m = self._target_m = self._at(self.clock.now())

    def _at(self, t_ns: int) -> float:
        left_m = self._target_m - self._from_m
        reach_m = max(0.0, self._speed_m_s * seconds(t_ns - self._since_ns))
        return self._from_m + math.copysign(min(reach_m, abs(left_m)), left_m)


class KnownArm(KnownDevice):
    """An arm that follows its commands up and down."""

    spec = ARM

    def __init__(self, clock: Clock) -> None:
        super().__init__(clock)
        self._from_m, self._since_ns = 0.2, 0
        self._twist = Twist()

    def read(self) -> ArmState:
        """Return the newest state."""
        seq = self.clock.now() // SAMPLE_NS
        return ArmState(seq * SAMPLE_NS, seq, Pose((0.4, 0.0, self._at(seq * SAMPLE_NS))), self._twist)

    def command(self, command: ArmCommand) -> ArmCommand:
        """Follow a command."""
        self.note("command", command)
        self._from_m, self._since_ns = self._at(self.clock.now()), self.clock.now()
        self._twist = command.twist
        return command

    def stop(self) -> None:
        """Stand still."""
        super().stop()
        self._from_m, self._since_ns, self._twist = self._at(self.clock.now()), self.clock.now(), Twist()

    def _at(self, t_ns: int) -> float:
        return self._from_m + self._twist.linear_m_s[2] * max(0.0, seconds(t_ns - self._since_ns))


class KnownPoses(KnownDevice):
    """A pose source of a gripper and an object that rise."""

    def read(self) -> PoseSample:
        """Return the newest poses."""
        seq = self.clock.now() // SAMPLE_NS
        height_m = 0.2 + 1e-4 * seq
        return PoseSample(
            seq * SAMPLE_NS, seq, {"gripper": Pose((0.4, 0.0, height_m)), "object": Pose((0.4, 0.0, height_m - 0.02))}
        )


class KnownCell(Part, QuietCell):
    """A cell in which nothing slips."""

    def __init__(self, clock: Clock) -> None:
        Part.__init__(self, clock)
        QuietCell.__init__(self)
