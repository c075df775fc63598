"""Commands from the engine to gripper and arm. Each is clamped by the guard and has an expiry."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from lsds.clock import nanoseconds
from lsds.contracts import ArmCommand, Grip, GripperCommand, Twist
from lsds.errors import CommandExpired, SafetyStop
from lsds.safety.deadlines import Deadlines
from lsds.safety.device_calls import Calls
from lsds.safety.gripper_monitor import FingersWatch
from lsds.safety.guard import Guard, correction_opens_m
from lsds.safety.monitors import ArrivalWatch

if TYPE_CHECKING:
    from collections.abc import Callable

    from lsds.clock import Clock
    from lsds.config import RigConfig
    from lsds.contracts import Arm, Gripper, GripperState


class Actuation:
    """Sends commands to gripper and arm.

    `held_m` is the aperture last sent, NaN before the first command; `opened` is true if the last grip wanted by the
    job was wider than where the fingers were. `moving` is the velocity that the arm last accepted, at `moved_ns`.
    """

    def __init__(
        self,
        gripper: Gripper | None,
        arm: Arm | None,
        config: RigConfig,
        clock: Clock,
        may_send: Callable[[], None] = lambda: None,
        calls: Calls | None = None,
    ) -> None:
        """`may_send` is called before every command, and raises if the cell has been stopped in the meantime."""
        self._calls = Calls() if calls is None else calls
        deadlines = Deadlines(config.deadlines, virtual=getattr(clock, "virtual", False))
        self._commands = tuple(
            deadlines.of(f"{kind} '{config.section(kind).backend}'", "command") for kind in ("gripper", "arm")
        )
        self.guard = Guard(config.safety)
        self.held_m = math.nan
        self.opened = False
        self.moving = Twist()
        self.moved_ns: int | None = None
        self._may_send = may_send
        self._pending = False
        self._expiring_ns: int | None = None
        self._stale_ns = nanoseconds(config.safety.stale_after_s)
        self._gripper = gripper
        self._arm = arm
        self._clock = clock
        self._lifetime_ns = nanoseconds(config.safety.command_lifetime_s)
        tick_m = gripper.spec.resolution_m if gripper is not None else 0.0
        self._arrival, self._fingers = ArrivalWatch(tick_m), FingersWatch(tick_m)
        self._opening_m = correction_opens_m(tick_m)
        self._wanted: Grip | None = None
        task = config.task
        self._correction = (task.grip_speed_m_s, task.grip_force_n)

    def grip(self, wanted: Grip | None, state: GripperState | None, now_ns: int) -> bool:
        """Send the grip that a job wants: once, and again if the gripper did not receive it. Return whether it did.

        The same grip again is not a new command, because a correction may have closed the fingers further since.
        """
        if wanted is None or self._gripper is None:
            return False
        if wanted == self._wanted and not self._arrival.lost(state, now_ns):
            return False
        sent = self._send(wanted, opens_by_m=math.inf)
        # Until it is really sent, the fingers rest at an earlier grip, which is no arrival.
        self._pending = sent is None
        if sent is not None:
            # Fingers that are under way may be asked to go a little less far: that lets nothing go.
            self.opened = state is not None and sent > state.aperture_m + self._gripper.spec.resolution_m
            self._wanted = wanted
            self._correction = (wanted.speed_m_s, wanted.force_n)
            self._arrival.sent(sent, now_ns)
        return sent is not None

    def watch(self, state: GripperState | None, now_ns: int) -> None:
        """Send a correction again that was lost. Raises SafetyStop where the fingers opened, or do not follow."""
        if state is None:
            return
        self._fingers.check(state, now_ns)
        if self._fingers.lost(state, now_ns):
            self._send(Grip(self.held_m, *self._correction), opens_by_m=0.0, corrects=True)

    def arrived(self, state: GripperState | None, now_ns: int) -> bool:
        """Return whether the fingers rest at the last wanted grip; true without a gripper."""
        return self._gripper is None or (not self._pending and self._arrival.arrived(state, now_ns))

    def correct(self, aperture_m: float, *, may_open: bool) -> float | None:
        """Send a correction of the grip; return the aperture sent, None if it came too late.

        It opens by `correction_opens_m` at most: what an opening does has to be seen before the next.
        """
        opens_by_m = self._opening_m if may_open else 0.0
        sent = self._send(Grip(aperture_m, *self._correction), opens_by_m=opens_by_m, corrects=True)
        if sent is not None:
            self._arrival.superseded()
        return sent

    def move(self, twist: Twist, acceleration_m_s2: float) -> None:
        """Send a velocity to the arm."""
        if self._arm is not None:
            self._may_send()
            command = ArmCommand(twist, acceleration_m_s2, self._clock.now() + self._lifetime_ns)
            wanted = self.guard.arm(command)
            self.moving = self._calls.expect(ArmCommand, self._commands[1], self._arm.command, wanted).twist
            self.moved_ns = self._clock.now()

    def _send(self, grip: Grip, *, opens_by_m: float, corrects: bool = False) -> float | None:
        gripper = self._gripper
        if gripper is None:
            return None
        stroke = gripper.spec.stroke_m
        aperture_m = min(max(grip.aperture_m, 0.0), stroke) if math.isfinite(grip.aperture_m) else grip.aperture_m
        self._may_send()
        # The lifetime of a command starts when it is sent, not when its frame arrived.
        expires = self._clock.now() + self._lifetime_ns
        command = GripperCommand(aperture_m, grip.speed_m_s, grip.force_n, expires)
        held = self.held_m if math.isfinite(self.held_m) else stroke
        command = self.guard.gripper(command, held, opens_by_m=opens_by_m)
        try:
            sent = self._calls.expect(GripperCommand, self._commands[0], gripper.command, command)
        except CommandExpired as error:
            # Leave the grip unchanged; the next frame gives a new command. Only for a time: the arm relies on the grip.
            now = self._clock.now()
            self._expiring_ns = now if self._expiring_ns is None else self._expiring_ns
            if now - self._expiring_ns > self._stale_ns:
                raise SafetyStop(f"gripper: every command expires before it is carried out ({error})") from error
            return None
        self._expiring_ns = None
        self.held_m = sent.aperture_m
        self._fingers.sent(command.aperture_m, sent.aperture_m, self._clock.now(), corrects=corrects)
        return sent.aperture_m
