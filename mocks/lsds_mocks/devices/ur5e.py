"""Mock UR5e: follows vertical Cartesian velocities of the TCP, with the controller's 500 Hz grid and limits.

The plant models vertical motion and, if the object is clamped, rotation about the pads' normal (y of the base). A
command with any other component is refused instead of being ignored. After a rotation, up is along the pads' axis.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from lsds.contracts import ArmCommand, ArmSpec, ArmState, Lifecycle, Pose, Twist
from lsds.contracts.lifecycle import LifecycleGuard
from lsds.contracts.plant import join
from lsds.errors import DeviceFault, LimitExceeded
from lsds_mocks.devices.command_line import CommandLine, require_unexpired

if TYPE_CHECKING:
    from lsds.contracts import BuildContext
    from lsds.contracts.plant import Action, Motion
    from lsds_mocks.devices.ur5e_options import UR5eOptions

NAME = "mock-ur5e"
CONTROL_CYCLE_NS = 2_000_000
"""Control cycle of an e-Series arm (ns): 500 Hz."""
ARM_REACH_M = 0.85
"""Reach of the arm (Universal Robots, UR5e data sheet)."""
TCP_X_M = 0.4
"""Position of the tool along x, m; chosen."""
TCP_Y_M = 0.0
"""Position of the tool along y, m; chosen."""
TURN_LIMIT_RAD_S = 3.14
"""Maximum speed of the wrist, rad/s."""
TURN_RAD_S2 = 40.0
"""Maximum acceleration of the wrist, rad/s^2."""


class MockUR5e:
    """An `Arm` in the simulated cell. TCP height in the base frame is the pads' height above the table."""

    def __init__(self, options: UR5eOptions, context: BuildContext) -> None:
        self.options = options
        self.cell = join(context)
        self._clock = context.clock
        self._guard = LifecycleGuard(NAME)
        self._line = CommandLine(
            self.cell,
            NAME,
            latency_ms=options.latency_ms,
            jitter_ms=options.latency_jitter_ms,
            cycle_ns=CONTROL_CYCLE_NS,
            seed=context.rng_seed("ur5e latency"),
        )
        self._connected_ns = 0
        self._sent = 0
        self._running = 0
        self._protective_stop = False

    @property
    def lifecycle(self) -> Lifecycle:
        """The lifecycle state of the device."""
        return self._guard.state

    @property
    def spec(self) -> ArmSpec:
        """Speed, acceleration, reach."""
        return ArmSpec(self.options.speed_limit_m_s, self.options.acceleration_limit_m_s2, ARM_REACH_M)

    def connect(self) -> None:
        """Make it readable."""
        with self._guard.connecting():
            self._connected_ns = self._clock.now()

    def arm(self) -> None:
        """Accept commands; clears a protective stop, as an operator at the pendant would."""
        with self._guard.arming():
            self._protective_stop = False

    def stop(self) -> None:
        """Decelerate to rest."""
        if self._guard.state not in (Lifecycle.NEW, Lifecycle.CLOSED):
            self._line.stop(self._clock.now(), self._brake)

    def disarm(self) -> None:
        """Decelerate to rest and accept no more commands."""
        with self._guard.disarming() as armed:
            if armed:
                self.stop()

    def close(self) -> None:
        """Decelerate to rest and close the device."""
        with self._guard.closing() as first:
            if first:
                self._line.stop(self._clock.now(), self._brake)

    def read(self) -> ArmState:
        """Return the state of the controller's last cycle."""
        self._guard.require_readable()
        now = self._clock.now()
        self.cell.advance(now)
        cycle = now - now % CONTROL_CYCLE_NS
        moment = self.cell.moment(cycle)
        return ArmState(
            t_ns=moment.t_ns,
            seq=max(0, cycle // CONTROL_CYCLE_NS - self._connected_ns // CONTROL_CYCLE_NS),
            tcp_pose=Pose((TCP_X_M, TCP_Y_M, moment.arm_z_m), _turned(moment.turn_rad)),
            tcp_twist=Twist((0.0, 0.0, moment.arm_v_m_s), (0.0, moment.turn_rad_s, 0.0)),
            protective_stop=self._protective_stop,
        )

    def command(self, command: ArmCommand) -> ArmCommand:
        """Send a command, limited to the arm's speed and acceleration; return the command that was sent.

        Raises LifecycleError, LimitExceeded (not finite, not vertical, acceleration not positive), CommandExpired,
        DeviceFault while in protective stop.
        """
        self._guard.require_armed()
        self._check(command)
        now = self._clock.now()
        require_unexpired(NAME, now, command.expires_ns)
        speed, limit = command.twist.linear_m_s[2], self.options.speed_limit_m_s
        acceleration = command.acceleration_m_s2
        if self.options.protective_stop_on_excess and (
            abs(speed) > limit or acceleration > self.options.acceleration_limit_m_s2
        ):
            self._protective_stop = True
            self._line.stop(now, self._brake)
            raise DeviceFault(NAME, "protective stop: command beyond the limits", remedy="disarm and arm again")
        speed = min(max(speed, -limit), limit)
        acceleration = min(acceleration, self.options.acceleration_limit_m_s2)
        self._sent += 1
        turn = min(max(command.twist.angular_rad_s[1], -TURN_LIMIT_RAD_S), TURN_LIMIT_RAD_S)
        follow, expire = self._follow(self._sent, speed, turn, acceleration), self._expire(self._sent)
        effect_ns = self._line.send(now, follow, lost=self.options.command_loss)
        self._line.post(max(effect_ns, command.expires_ns), expire)
        return ArmCommand(Twist((0.0, 0.0, speed), (0.0, turn, 0.0)), acceleration, command.expires_ns)

    def _check(self, command: ArmCommand) -> None:
        numbers = (*command.twist.linear_m_s, *command.twist.angular_rad_s, command.acceleration_m_s2)
        if not all(map(math.isfinite, numbers)):
            raise LimitExceeded(NAME, f"not a finite command: {command}", remedy="command numbers only")
        x, y, _ = command.twist.linear_m_s
        about_x, about_y, about_z = command.twist.angular_rad_s
        if x or y or about_x or about_z:
            raise LimitExceeded(NAME, "the simulated cell models vertical motion only", remedy="command z only")
        if about_y and not self.cell.can_turn:
            remedy = "command z only, or clamp the object (cell.simulated.clamped)"
            raise LimitExceeded(NAME, "the simulated cell models turning about a clamped object only", remedy=remedy)
        if command.acceleration_m_s2 <= 0:
            raise LimitExceeded(NAME, "acceleration must be above zero")
        if self._protective_stop:
            raise DeviceFault(NAME, "in protective stop", remedy="disarm and arm again")

    def _follow(self, number: int, speed_m_s: float, turn_rad_s: float, acceleration_m_s2: float) -> Action:
        def action(motion: Motion) -> None:
            self._running = number
            motion.drive_arm(speed_m_s, acceleration_m_s2, turn_rad_s, TURN_RAD_S2)

        return action

    def _expire(self, number: int) -> Action:
        def action(motion: Motion) -> None:
            if self._running == number:
                self._brake(motion)

        return action

    def _brake(self, motion: Motion) -> None:
        motion.drive_arm(0.0, self.options.stop_acceleration_m_s2, 0.0, TURN_RAD_S2)


def _turned(angle_rad: float) -> tuple[float, float, float, float]:
    return 0.0, math.sin(angle_rad / 2), 0.0, math.cos(angle_rad / 2)
