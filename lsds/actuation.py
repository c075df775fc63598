"""Commands from the engine to gripper and arm. Each is clamped by the guard and has an expiry."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from lsds.clock import nanoseconds
from lsds.contracts import ArmCommand, Grip, GripperCommand, Twist
from lsds.errors import CommandExpired
from lsds.safety import Guard
from lsds.watches import ArrivalWatch

if TYPE_CHECKING:
    from lsds.clock import Clock
    from lsds.config import RigConfig
    from lsds.contracts import Arm, Gripper, GripperState


class Actuation:
    """Sends commands to gripper and arm.

    `held_m` is the aperture last sent, NaN before the first command; `opened` is true if the last grip wanted by the
    job was wider than the held aperture.
    """

    def __init__(self, gripper: Gripper | None, arm: Arm | None, config: RigConfig, clock: Clock) -> None:
        self.guard = Guard(config.safety)
        self.held_m = math.nan
        self.opened = False
        self._gripper = gripper
        self._arm = arm
        self._clock = clock
        self._lifetime_ns = nanoseconds(config.safety.command_lifetime_s)
        self._arrival = ArrivalWatch(gripper.spec.resolution_m if gripper is not None else 0.0)
        self._wanted: Grip | None = None
        task = config.task
        self._correction = (task.grip_speed_m_s, task.grip_force_n)

    def grip(self, wanted: Grip | None, state: GripperState | None, now_ns: int) -> None:
        """Send the grip that a job wants: once, and again if the gripper did not receive it.

        The same grip again is not a new command, because a correction may have closed the fingers further since.
        """
        if wanted is None or self._gripper is None:
            return
        if wanted == self._wanted and not self._arrival.lost(state, now_ns):
            return
        held = self.held_m
        sent = self._send(wanted, allow_opening=True)
        if sent is not None:
            self.opened = sent > held  # False while nothing is held, because a comparison with NaN is false.
            self._wanted = wanted
            self._correction = (wanted.speed_m_s, wanted.force_n)
            self._arrival.sent(sent, now_ns)

    def arrived(self, state: GripperState | None, now_ns: int) -> bool:
        """Return whether the fingers rest at the last wanted grip; true without a gripper."""
        return self._gripper is None or self._arrival.arrived(state, now_ns)

    def correct(self, aperture_m: float, *, may_open: bool) -> float | None:
        """Send a correction of the grip; return the aperture sent, None if it came too late."""
        return self._send(Grip(aperture_m, *self._correction), allow_opening=may_open)

    def move(self, twist: Twist, acceleration_m_s2: float) -> None:
        """Send a velocity to the arm."""
        if self._arm is not None:
            command = ArmCommand(twist, acceleration_m_s2, self._clock.now() + self._lifetime_ns)
            self._arm.command(self.guard.arm(command))

    def _send(self, grip: Grip, *, allow_opening: bool) -> float | None:
        gripper = self._gripper
        if gripper is None:
            return None
        stroke = gripper.spec.stroke_m
        aperture_m = min(max(grip.aperture_m, 0.0), stroke) if math.isfinite(grip.aperture_m) else grip.aperture_m
        # The lifetime of a command starts when it is sent, not when its frame arrived.
        expires = self._clock.now() + self._lifetime_ns
        command = GripperCommand(aperture_m, grip.speed_m_s, grip.force_n, expires)
        held = self.held_m if math.isfinite(self.held_m) else stroke
        try:
            sent = gripper.command(self.guard.gripper(command, held, allow_opening=allow_opening))
        except CommandExpired:
            # Leave the grip unchanged; the next frame gives a new command.
            return None
        self.held_m = sent.aperture_m
        return sent.aperture_m
