"""The driver of the RG2: life cycle, limits, rounding, and faults. `Ticker` calls the pump."""

from __future__ import annotations

import contextlib
import math
from typing import Protocol

from lsds.clock import Clock
from lsds.contracts import BuildContext, Contact, GripperCommand, GripperSpec, GripperState, Lifecycle
from lsds.contracts.lifecycle import LifecycleGuard
from lsds.errors import CommandExpired, DeviceError, DeviceFault, LimitExceeded, StaleData

from lsds_onrobot_rg2.bus import Bus, ModbusBus
from lsds_onrobot_rg2.options import MockOptions, Options
from lsds_onrobot_rg2.pump import Motion, Pump
from lsds_onrobot_rg2.registers import SPEC, TENTHS_PER_M, Status
from lsds_onrobot_rg2.ticker import ThreadTicker

NAME = "onrobot-rg2"


class Ticker(Protocol):
    """Calls `Pump.step` at a fixed rate: a thread, or the plant of the simulated cell."""

    def start(self, pump: Pump) -> None:
        """Begin."""
        ...

    def catch_up(self) -> None:
        """Do the steps that are due now. A thread needs no help."""
        ...

    def stop(self) -> None:
        """End; no step runs afterwards. A second call does nothing."""
        ...


class Rg2Gripper:
    """A `Gripper`."""

    def __init__(self, name: str, bus: Bus, ticker: Ticker, options: MockOptions, clock: Clock) -> None:
        self._name = name
        self._bus = bus
        self._ticker = ticker
        self._stale_ns = round(options.stale_after_ms * 1e6)
        self._clock = clock
        self._guard = LifecycleGuard(name)
        self._pump = Pump(name, bus)
        self._seq, self._last_ns = 0, -1

    @property
    def lifecycle(self) -> Lifecycle:
        """The state of the life cycle."""
        return self._guard.state

    @property
    def spec(self) -> GripperSpec:
        """Stroke, resolution, speed and force ranges."""
        return SPEC

    def connect(self) -> None:
        """Connect and read the first status; nothing moves. Raises ConnectFailed, DeviceTimeout, ProtocolFault."""
        with self._guard.connecting():
            self._bus.open()
            self._pump.step(self._clock.now())
            if self._pump.error is not None:
                self._bus.close()
                raise self._pump.error
            self._ticker.start(self._pump)

    def arm(self) -> None:
        """Accept commands. Raises DeviceFault if a safety flag is set."""
        with self._guard.arming():
            self._status()

    def stop(self) -> None:
        """Stop the fingers where they are; never opens them."""
        if self._guard.state in (Lifecycle.CONNECTED, Lifecycle.ARMED):
            self._ticker.catch_up()
            with contextlib.suppress(DeviceError):
                self._pump.stop()

    def disarm(self) -> None:
        """Stop the fingers and accept no more commands."""
        with self._guard.disarming() as armed:
            if armed:
                self.stop()

    def close(self) -> None:
        """Stop the fingers and release the connection; the grip stays closed."""
        with self._guard.closing() as first:
            if first:
                armed_or_connected = self._pump.status is not None
                self._ticker.stop()
                if armed_or_connected:
                    with contextlib.suppress(DeviceError):
                        self._pump.stop()
                self._bus.close()

    def read(self) -> GripperState:
        """Return the newest state. Raises DeviceFault with the safety flag, StaleData with the failure behind it."""
        self._guard.require_readable()
        status = self._status()
        if status.t_ns != self._last_ns:
            self._seq, self._last_ns = self._seq + 1, status.t_ns
        target_m = self._pump.target_m
        target_m = status.aperture_m if target_m is None else target_m
        closes = status.gripping and target_m <= status.aperture_m
        contact = Contact.NONE if not status.gripping else Contact.CLOSING if closes else Contact.OPENING
        return GripperState(status.t_ns, self._seq, status.aperture_m, target_m, status.busy, contact)

    def command(self, command: GripperCommand) -> GripperCommand:
        """Send a command; return it as sent. Raises LifecycleError, LimitExceeded, CommandExpired, and as `read`."""
        self._guard.require_armed()
        if not all(map(math.isfinite, (command.aperture_m, command.speed_m_s, command.force_n))):
            raise LimitExceeded(self._name, f"not a finite command: {command}", remedy="command numbers only")
        if self._clock.now() >= command.expires_ns:
            raise CommandExpired(self._name, "the command came after its expiry", remedy="send a fresh one")
        self._status()
        aperture_m = round(_within(command.aperture_m, (0.0, SPEC.stroke_m)) * TENTHS_PER_M) / TENTHS_PER_M
        force_n = round(_within(command.force_n, SPEC.force_n), 1)
        self._pump.move(Motion(aperture_m, force_n, command.expires_ns))
        return GripperCommand(aperture_m, SPEC.speed_m_s[0], force_n, command.expires_ns)

    def _status(self) -> Status:
        """Return the newest status, if it is fresh and without a fault."""
        self._ticker.catch_up()
        status, error = self._pump.status, self._pump.error
        if status is None or self._clock.now() - status.t_ns > self._stale_ns:
            problem = f"no status for {self._stale_ns * 1e-6:.0f} ms"
            remedy = "check the Compute Box and its network"
            if error is not None:
                problem, remedy = f"{problem}: {error.problem}", error.remedy or remedy
            raise StaleData(self._name, problem, remedy=remedy) from error
        if status.fault is not None:
            problem, remedy = status.fault
            raise DeviceFault(self._name, problem, remedy=remedy)
        return status


def build(options: Options, context: BuildContext) -> Rg2Gripper:
    """Return the driver of a gripper behind a Compute Box."""
    ticker = ThreadTicker(NAME, options.poll_hz, context.clock)
    return Rg2Gripper(NAME, ModbusBus(NAME, options), ticker, options, context.clock)


def _within(value: float, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0]), limits[1])
