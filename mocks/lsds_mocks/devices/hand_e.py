"""Mock Robotiq Hand-E with the ticks, bytes, latency and object detection of the real one, on the shared plant."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from lsds.contracts import Contact, GripperCommand, GripperSpec, GripperState, Lifecycle
from lsds.contracts.lifecycle import LifecycleGuard
from lsds.contracts.plant import join
from lsds.errors import LimitExceeded
from lsds_mocks.devices.command_line import CommandLine, require_unexpired
from lsds_mocks.devices.hand_e_units import FORCE_N, SPEED_RANGE_M_S, HandEUnits, from_byte, to_byte

if TYPE_CHECKING:
    from lsds.contracts import BuildContext
    from lsds.contracts.plant import Motion
    from lsds_mocks.devices.hand_e_options import HandEOptions

NAME = "mock-hand-e"
REGISTER_CYCLE_NS = 5_000_000
"""Registers are refreshed at 200 Hz."""
ACTIVATION_NS = 1_500_000_000
"""Duration of an activation, in which the fingers close and open fully, ns; chosen."""


class MockHandE:
    """A `Gripper` in the simulated cell."""

    def __init__(self, options: HandEOptions, context: BuildContext) -> None:
        self.options = options
        self.cell = join(context)
        self.units = HandEUnits(options.stroke_mm * 1e-3, options.open_tick, options.closed_tick)
        self._clock = context.clock
        self._guard = LifecycleGuard(NAME)
        self._line = CommandLine(
            self.cell,
            NAME,
            latency_ms=options.latency_ms,
            jitter_ms=options.latency_jitter_ms,
            cycle_ns=REGISTER_CYCLE_NS,
            seed=context.rng_seed("hand-e latency"),
        )
        self._connected_ns = 0

    @property
    def lifecycle(self) -> Lifecycle:
        """The lifecycle state of the device."""
        return self._guard.state

    @property
    def spec(self) -> GripperSpec:
        """Stroke, resolution, speed and force ranges."""
        return GripperSpec(
            self.units.stroke_m,
            self.units.metres_per_tick,
            SPEED_RANGE_M_S,
            FORCE_N,
            latency_s=self.options.latency_ms * 1e-3,
        )

    def connect(self) -> None:
        """Make it readable."""
        with self._guard.connecting():
            self._connected_ns = self._clock.now()

    def arm(self) -> None:
        """Activate the gripper if necessary (full close and full open), waiting on the rig's clock."""
        with self._guard.arming():
            if not self.options.activated:
                now = self._clock.now()
                self._line.post(now, _go(0.0, 0.1, FORCE_N[0]))
                self._line.post(now + ACTIVATION_NS // 2, _go(self.units.stroke_m, 0.1, FORCE_N[0]))
                self._clock.sleep_until(now + ACTIVATION_NS)

    def stop(self) -> None:
        """Stop the fingers at their present aperture; never opens."""
        if self._guard.state not in (Lifecycle.NEW, Lifecycle.CLOSED):
            self._line.stop(self._clock.now(), _hold)

    def disarm(self) -> None:
        """Stop the fingers and accept no more commands."""
        with self._guard.disarming() as armed:
            if armed:
                self.stop()

    def close(self) -> None:
        """Stop the fingers and close the device; the grip stays closed."""
        with self._guard.closing() as first:
            if first:
                self._line.stop(self._clock.now(), _hold)

    def read(self) -> GripperState:
        """Return the registers as last refreshed."""
        self._guard.require_readable()
        now = self._clock.now()
        self.cell.advance(now)
        refreshed = now - now % REGISTER_CYCLE_NS
        moment = self.cell.moment(refreshed)
        return GripperState(
            t_ns=moment.t_ns,
            seq=max(0, refreshed // REGISTER_CYCLE_NS - self._connected_ns // REGISTER_CYCLE_NS),
            aperture_m=self.units.aperture_m(self.units.tick(moment.aperture_m)),
            target_m=self.units.aperture_m(self.units.tick(moment.target_m)),
            moving=moment.moving,
            contact=Contact.CLOSING if moment.stalled else Contact.NONE,
        )

    def command(self, command: GripperCommand) -> GripperCommand:
        """Send position, speed and force bytes; return the command that they encode.

        Raises LifecycleError, LimitExceeded if a value is not finite, CommandExpired.
        """
        self._guard.require_armed()
        if not all(map(math.isfinite, (command.aperture_m, command.speed_m_s, command.force_n))):
            raise LimitExceeded(NAME, f"not a finite command: {command}", remedy="command numbers only")
        now = self._clock.now()
        require_unexpired(NAME, now, command.expires_ns)
        aperture = self.units.aperture_m(self.units.tick(command.aperture_m))
        speed = from_byte(to_byte(command.speed_m_s, SPEED_RANGE_M_S), SPEED_RANGE_M_S)
        force = from_byte(to_byte(command.force_n, FORCE_N), FORCE_N)
        self._line.send(now, _go(aperture, speed, force), lost=self.options.command_loss)
        return GripperCommand(aperture, speed, force, command.expires_ns)


class _go:
    """Action that moves the fingers to an aperture at a speed with a force limit."""

    def __init__(self, aperture_m: float, speed_m_s: float, force_n: float) -> None:
        self.aperture_m = aperture_m
        self.speed_m_s = speed_m_s
        self.force_n = force_n

    def __call__(self, motion: Motion) -> None:
        motion.drive_fingers(self.aperture_m, self.speed_m_s, self.force_n)


def _hold(motion: Motion) -> None:
    motion.hold_fingers()
