"""The gripper driver: life cycle, reads and commands over any transport. See `lsds.contracts.Gripper`."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from lsds.clock import nanoseconds, seconds
from lsds.contracts import Contact, GripperCommand, GripperSpec, GripperState, Lifecycle
from lsds.contracts.lifecycle import LifecycleGuard
from lsds.errors import CommandExpired, DeviceFault, LimitExceeded, StaleData
from lsds_drivers.robotiq.activation import STATUS_ANSWER_S, Arming
from lsds_drivers.robotiq.fault_codes import NOT_ACTIVATED, blocks, device_fault
from lsds_drivers.robotiq.pump import Counts, Order, Pump
from lsds_drivers.robotiq.registers import (
    ACTIVATE,
    GO_TO,
    RELEASE,
    RELEASE_OPENING,
    Activation,
    Detection,
    Status,
)

if TYPE_CHECKING:
    from lsds.clock import Clock
    from lsds_drivers.robotiq.options import GripperOptions
    from lsds_drivers.robotiq.transport import Transport

GRIPPER_STOP_S = 0.8
"""Time limit of `stop` (s); a stop that takes longer is still sent later."""
GRIPPER_CLOSE_S = 2.0
"""Time limit of `close` for the end of the gripper's thread (s); chosen."""
ECHO_NS = 50_000_000
"""Time without the echo of an acknowledged request after which the registers count as not refreshed. The manual states
a refresh rate of 200 Hz ("Control"); ten periods are assumed to cover a URCap's controller, too."""

MOTION_NS = 500_000_000
"""Time without a change of a status that reports motion after which the registers count as not refreshed (ns); chosen.
At the slowest speed the position changes by a count every 11 ms."""

_CONTACT = {Detection.CONTACT_OPENING: Contact.OPENING, Detection.CONTACT_CLOSING: Contact.CLOSING}


class RobotiqGripper:
    """A `Gripper`. It opens only by a command, an activation in `arm`, or `automatic_release`.

    Reading and commanding do no I/O: a separate thread communicates with the gripper.
    """

    def __init__(self, device: str, options: GripperOptions, transport: Transport, clock: Clock) -> None:
        self.device = device
        self._options = options
        self._figures = options.figures()
        self._clock = clock
        self._guard = LifecycleGuard(device)
        self._stale_ns = nanoseconds(options.stale_after_ms * 1e-3)
        self._arming = self._calibrated = False
        self._pump = Pump(
            device,
            transport,
            clock,
            poll_hz=options.poll_hz,
            open_s=options.answer_timeout_ms * 1e-3,
            silence_s=options.reconnect_after_s,
            life_check_s=options.life_check_s,
        )

    @property
    def lifecycle(self) -> Lifecycle:
        """The state of the device's life cycle."""
        return self._guard.state

    @property
    def spec(self) -> GripperSpec:
        """Stroke (m), resolution (m), ranges of speed (m/s) and force (N)."""
        figures = self._figures
        return GripperSpec(figures.stroke_m, figures.resolution_m, figures.speed_m_s, figures.force_n)

    @property
    def counts(self) -> Counts:
        """Counts of requests and commands since connecting: sent, replaced, expired, refused and more."""
        return self._pump.counts

    def connect(self) -> None:
        """Open the port and read a first status; moves nothing. Raises ConnectFailed with a remedy."""
        with self._guard.connecting():
            self._pump.open(self._options.connect_timeout_s)

    def arm(self) -> None:
        """Activate if it is not active (full close and open), and calibrate if the options request it.

        Raises DeviceFault with the gripper's code, DeviceTimeout, ProtocolFault. A `stop` from another thread ends it.
        """
        with self._guard.arming(), self._while_arming():
            arming = Arming(self.device, self._pump, self._clock)
            if not (arming.is_active() and self._options.keep_activation):
                arming.activate(self._options.activation_timeout_s)
                self._calibrated = False
            if self._options.calibrate and not self._calibrated:
                slowest_s = self._figures.stroke_m / self._figures.speed_m_s[0]
                self._figures = arming.calibrate(self._figures, slowest_s + STATUS_ANSWER_S)
                self._calibrated = True

    def stop(self) -> None:
        """Stop the fingers at their present aperture by clearing the go-to bit. Returns within a second; never raises.

        If the gripper does not answer in that time, the stop is sent as soon as it answers again.
        """
        if self._guard.state is not Lifecycle.CLOSED:
            self._pump.halt(GRIPPER_STOP_S)

    def disarm(self) -> None:
        """Stop the fingers, and accept no more commands."""
        if self._guard.state is Lifecycle.ARMED:
            self.stop()
        with self._guard.disarming():
            pass

    def close(self) -> None:
        """Stop the fingers if it was armed, end the thread, close the port; the grip is kept."""
        if self._guard.state is Lifecycle.ARMED or self._arming:
            self.stop()
        with self._guard.closing() as first:
            if first:
                self._pump.end(GRIPPER_CLOSE_S)

    def read(self) -> GripperState:
        """Return the newest state. Does no I/O.

        Raises LifecycleError; StaleData if the newest state is older than `stale_after_ms` (its cause is the last
        request's DeviceTimeout, ProtocolFault or ConnectFailed) or the registers are not refreshed; DeviceFault with
        the gripper's code if a fault blocks commands or the gripper has lost its activation.
        """
        self._guard.require_readable()
        sample = self._pump.newest
        now = self._clock.now()
        if sample is None or now - sample.t_ns > self._stale_ns:
            raise self._stale(now) from self._pump.error
        self._require_well(sample.status)
        self._require_refreshed(sample.t_ns)
        status, figures = sample.status, self._figures
        aperture = figures.aperture_m(status.position)
        goes = status.going and status.activation is Activation.ACTIVE
        return GripperState(
            t_ns=sample.t_ns,
            seq=sample.seq,
            aperture_m=aperture,
            target_m=figures.aperture_m(status.echo) if goes else aperture,
            moving=(goes and status.detection is Detection.MOVING) or status.activation is Activation.ACTIVATING,
            contact=_CONTACT.get(status.detection, Contact.NONE) if goes else Contact.NONE,
        )

    def command(self, command: GripperCommand) -> GripperCommand:
        """Pass a motion to the I/O thread; return it as rounded to the gripper's counts. Does no I/O.

        It replaces a motion that was not sent yet. An expired motion is not sent; `counts` shows the outcome.
        Raises LifecycleError, LimitExceeded (not finite), CommandExpired, StaleData, DeviceFault.
        """
        self._guard.require_armed()
        if not all(map(math.isfinite, (command.aperture_m, command.speed_m_s, command.force_n))):
            raise LimitExceeded(self.device, f"not a finite command: {command}", remedy="command numbers only")
        now = self._clock.now()
        if now >= command.expires_ns:
            late_ms = (now - command.expires_ns) / 1e6
            raise CommandExpired(
                self.device, f"command came {late_ms:.1f} ms after its expiry", remedy="send a new one"
            )
        sample = self._pump.newest
        if sample is None or now - sample.t_ns > self._stale_ns:
            raise self._stale(now) from self._pump.error
        self._require_well(sample.status)
        figures = self._figures
        motion = figures.motion(command)
        self._pump.post(Order(ACTIVATE | GO_TO, motion, command.expires_ns))
        return GripperCommand(
            figures.aperture_m(motion.position),
            figures.speed_of(motion.speed),
            figures.force_of(motion.force),
            command.expires_ns,
        )

    def automatic_release(self, *, opening: bool = True) -> None:
        """Release in an emergency: a slow full motion, after which the gripper accepts commands only after arming
        again.

        Only this call requests it; it is not part of the `Gripper` contract. It returns once the request is sent;
        `read` then raises DeviceFault with code 0x0B, and 0x0F at the end. Raises LifecycleError before `arm`,
        StaleData if the request could not be sent.
        """
        self._guard.require_armed("automatic_release")
        order = Order(ACTIVATE | RELEASE | (RELEASE_OPENING if opening else 0), None)
        self._pump.post(order)
        if not self._pump.wait_sent(order, STATUS_ANSWER_S):
            raise self._stale(self._clock.now()) from self._pump.error

    # -- inside -------------------------------------------------------------------------------------------

    @contextlib.contextmanager
    def _while_arming(self) -> Iterator[None]:
        """Mark an arming that `close` has to end before it can take the lock."""
        self._arming = True
        try:
            yield
        finally:
            self._arming = False

    def _stale(self, now_ns: int) -> StaleData:
        sample, error = self._pump.newest, self._pump.error
        age = "there is no status yet" if sample is None else f"no status for {seconds(now_ns - sample.t_ns):.2f} s"
        if error is None:
            return StaleData(self.device, age, remedy="check converter and computer load")
        return StaleData(self.device, f"{age}: {error.problem}", remedy=error.remedy)

    def _require_well(self, status: Status) -> None:
        """Raise DeviceFault if the gripper does not accept commands; before `arm` it can be read without activation."""
        expected = status.fault == NOT_ACTIVATED and self._guard.state is not Lifecycle.ARMED
        if blocks(status.fault) and not expected:
            raise device_fault(self.device, status.fault, status.controller_fault)
        if self._guard.state is Lifecycle.ARMED and status.activation is not Activation.ACTIVE:
            raise DeviceFault(
                self.device,
                "it has lost its activation",
                remedy="its power was cut or another client reset it; disarm() and arm() again, which moves it",
                code="0x07",
            )

    def _require_refreshed(self, t_ns: int) -> None:
        """Raise StaleData if the registers stand still.

        Either the status does not show an acknowledged request, also while newer ones follow it, or it reports motion
        and does not change.
        """
        for since_ns, limit_ns, what in (
            (self._pump.unechoed_ns, ECHO_NS, "does not show a request that it acknowledged {:.2f} s before"),
            (self._pump.moving_since_ns, MOTION_NS, "reports motion and has not changed for {:.2f} s"),
        ):
            if since_ns is not None and t_ns - since_ns > limit_ns:
                raise StaleData(
                    self.device,
                    f"its status {what.format(seconds(t_ns - since_ns))}: its registers stand still",
                    remedy="switch its power off and on",
                )
