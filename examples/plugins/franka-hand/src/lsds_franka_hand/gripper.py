"""The driver of the Franka Hand: life cycle, limits, rounding, and faults."""

from __future__ import annotations

import math

from lsds.clock import Clock, nanoseconds
from lsds.contracts import BuildContext, Contact, GripperCommand, GripperSpec, GripperState, Lifecycle
from lsds.contracts.lifecycle import LifecycleGuard
from lsds.errors import CommandExpired, ConnectFailed, DeviceError, DeviceFault, LimitExceeded, StaleData

from lsds_franka_hand.hand import LEAST_WIDTH_M, SPEC, Opener, libfranka_opener
from lsds_franka_hand.options import DriverOptions, Options
from lsds_franka_hand.reader import Reader, Status
from lsds_franka_hand.worker import LOOK_S, Motion, Worker

NAME = "franka-hand"
HOMING_S = 30.0
"""Time allowed for homing (s), assumed."""


class FrankaHand:
    """A `Gripper`."""

    def __init__(self, name: str, opener: Opener, options: DriverOptions, clock: Clock) -> None:
        self._name = name
        self._options = options
        self._clock = clock
        self._guard = LifecycleGuard(name)
        self._reader = Reader(name, opener, clock)
        self._worker = Worker(name, self._reader, clock, options.interrupt_limit_s)

    @property
    def lifecycle(self) -> Lifecycle:
        """The state of the life cycle."""
        return self._guard.state

    @property
    def spec(self) -> GripperSpec:
        """Stroke, resolution, speed and force ranges."""
        return SPEC

    def connect(self) -> None:
        """Connect and read the first state; nothing moves. Raises ConnectFailed."""
        with self._guard.connecting():
            try:
                self._reader.start()
            except DeviceError as error:
                if isinstance(error, ConnectFailed):
                    raise
                raise ConnectFailed(self._name, error.problem, remedy=error.remedy) from error
            self._worker.start()

    def arm(self) -> None:
        """Accept commands, after homing if the option `home` asks for it. Raises DeviceFault without a known width."""
        with self._guard.arming():
            self._worker.fault = None
            status = self._status()
            if status.max_width_m < LEAST_WIDTH_M:
                self._home(status)

    def stop(self) -> None:
        """Stop the fingers where they are; never opens them, and takes no pressure off a held object."""
        if self._guard.state in (Lifecycle.CONNECTED, Lifecycle.ARMED):
            self._worker.halt()

    def disarm(self) -> None:
        """Stop the fingers and accept no more commands."""
        with self._guard.disarming() as armed:
            if armed:
                self._worker.halt()

    def close(self) -> None:
        """Stop the fingers and release the connection; the grip stays closed."""
        with self._guard.closing() as first:
            if first:
                self._worker.end()
                self._reader.stop()

    def read(self) -> GripperState:
        """Return the newest state. Raises StaleData with the failure behind it, DeviceFault for a failed command."""
        self._guard.require_readable()
        status = self._status()
        target_m = self._worker.target_m
        target_m = status.width_m if target_m is None else target_m
        contact = Contact.CLOSING if self._worker.holds(status) else Contact.NONE
        return GripperState(status.t_ns, status.seq, status.width_m, target_m, self._worker.busy, contact)

    def command(self, command: GripperCommand) -> GripperCommand:
        """Send a command; return it as sent. Raises LifecycleError, LimitExceeded, CommandExpired, and as `read`."""
        self._guard.require_armed()
        if not all(map(math.isfinite, (command.aperture_m, command.speed_m_s, command.force_n))):
            raise LimitExceeded(self._name, f"not a finite command: {command}", remedy="command numbers only")
        if self._clock.now() >= command.expires_ns:
            raise CommandExpired(self._name, "the command came after its expiry", remedy="send a fresh one")
        widest_m = min(SPEC.stroke_m, self._homed(self._status()).max_width_m)
        ticks = round(_within(command.aperture_m, (0.0, widest_m)) / SPEC.resolution_m)
        aperture_m = min(ticks * SPEC.resolution_m, widest_m)
        speed_m_s = _within(command.speed_m_s, SPEC.speed_m_s)
        force_n = _within(command.force_n, SPEC.force_n)
        self._worker.submit(Motion(aperture_m, speed_m_s, force_n, command.expires_ns))
        return GripperCommand(aperture_m, speed_m_s, force_n, command.expires_ns)

    def _home(self, status: Status) -> None:
        if not self._options.home:
            self._homed(status)
        if status.grasped:
            remedy = "take the object out of the fingers first"
            raise DeviceFault(self._name, "homing would open the hand, and it holds an object", remedy=remedy)
        until_ns = self._clock.now() + nanoseconds(HOMING_S)
        self._worker.submit(Motion(SPEC.stroke_m, SPEC.speed_m_s[1], SPEC.force_n[0], until_ns, homing=True))
        if not self._worker.wait(HOMING_S):
            self._worker.halt()
            problem = f"homing has not ended after {HOMING_S:g} s"
            raise DeviceFault(self._name, problem, remedy="keep the fingers clear and try again")
        self._worker.target_m = None
        ended_ns = self._clock.now()
        # A state of the time before the homing still has the old width.
        while (status := self._status()).t_ns <= ended_ns:
            self._clock.sleep_until(self._clock.now() + nanoseconds(LOOK_S))
        self._homed(status)

    def _homed(self, status: Status) -> Status:
        """Return the status. Raises DeviceFault if the hand does not know its width."""
        if status.max_width_m < LEAST_WIDTH_M:
            remedy = "home it in Desk, or set home = true and keep the fingers clear"
            raise DeviceFault(self._name, "the hand has not been homed", remedy=remedy)
        return status

    def _status(self) -> Status:
        """Return the newest status, if it is fresh and no command has failed."""
        status, trouble = self._reader.status, self._reader.trouble
        if status is None or self._clock.now() - status.t_ns > self._options.stale_after_ms * 1e6:
            problem = f"no state for {self._options.stale_after_ms:g} ms"
            remedy = "check the robot and its network"
            if trouble is not None:
                problem, remedy = f"{problem}: {trouble.problem}", trouble.remedy or remedy
            raise StaleData(self._name, problem, remedy=remedy) from trouble
        if self._worker.fault is not None:
            raise self._worker.fault
        return status


def build(options: Options, context: BuildContext) -> FrankaHand:
    """Return the driver of a real hand. Opens nothing."""
    return FrankaHand(NAME, libfranka_opener(NAME, options.host), options, context.clock)


def _within(value: float, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0]), limits[1])
