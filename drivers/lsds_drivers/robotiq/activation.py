"""Arming: reset, activation, and optional calibration of the end counts. Only arming moves without a command."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from lsds.clock import Clock
from lsds.errors import DeviceError, DeviceFault, DeviceTimeout
from lsds_drivers.robotiq.fault_codes import blocks, device_fault
from lsds_drivers.robotiq.pump import Order
from lsds_drivers.robotiq.registers import ACTIVATE, GO_TO, Activation, Detection, Motion, Status

if TYPE_CHECKING:
    from lsds_drivers.robotiq.figures import Figures
    from lsds_drivers.robotiq.pump import Pump

STATUS_ANSWER_S = 2.0
"""Time limit for a status after a write, or for a write: allows several lost frames in a row."""
_FAULT_SETTLE_NS = 50_000_000
"""Time after the rising edge for which the status may still show a fault that the edge has cleared."""
_CALIBRATION = (128, 0)
"""Speed and force counts during calibration: half the speed, minimum force."""
_END_TOLERANCE = 15
"""Maximum difference between the configured and the measured end count; a greater one means that there is an object."""


class Arming:
    """One arming of one gripper."""

    def __init__(self, device: str, pump: Pump, clock: Clock) -> None:
        self._device = device
        self._pump = pump
        self._clock = clock
        self._halts = pump.halts

    def is_active(self) -> bool:
        """Return whether the gripper is active without a fault, from a new status. Raises DeviceTimeout."""
        status = self._await(lambda _status: True, STATUS_ANSWER_S, self._clock.now(), "did not report its status")
        return status.activation is Activation.ACTIVE and not blocks(status.fault)

    def activate(self, timeout_s: float) -> None:
        """Reset and activate: full close and open. Raises DeviceFault with the gripper's code, DeviceTimeout."""
        written = self._write(Order(0, None))
        self._await(lambda status: not status.activated, STATUS_ANSWER_S, written, "was not reset")
        written = self._write(Order(ACTIVATE, None))

        def over(status: Status) -> bool:
            failed = blocks(status.fault) and self._clock.now() - written > _FAULT_SETTLE_NS
            return failed or status.activation is Activation.ACTIVE

        status = self._await(over, timeout_s, written, f"was not active after {timeout_s:g} s")
        if blocks(status.fault):
            raise device_fault(self._device, status.fault, status.controller_fault)

    def calibrate(self, figures: Figures, timeout_s: float) -> Figures:
        """Close and open slowly; return the figures with the measured end counts. Raises DeviceFault."""
        closed = self._end_count(255, figures.closed_count, timeout_s)
        opened = self._end_count(0, figures.open_count, timeout_s)
        return replace(figures, open_count=opened, closed_count=closed)

    def _end_count(self, request: int, expected: int, timeout_s: float) -> int:
        written = self._write(Order(ACTIVATE | GO_TO, Motion(request, *_CALIBRATION)))
        status = self._await(
            lambda status: status.echo == request and status.detection is not Detection.MOVING,
            timeout_s,
            written,
            "did not reach the end of its stroke",
        )
        if abs(status.position - expected) > _END_TOLERANCE:
            raise DeviceFault(
                self._device,
                f"stopped at count {status.position} instead of about {expected}",
                remedy="remove any object from the fingers, or correct open_count and closed_count",
            )
        return status.position

    def _write(self, order: Order) -> int:
        """Send an order and wait until it is written; return the time of the write (ns)."""
        self._require_wanted()
        self._pump.post(order)
        sent = self._pump.wait_sent(order, STATUS_ANSWER_S)
        self._require_wanted()
        if not sent:
            raise self._silence("did not acknowledge the request to begin")
        return self._clock.now()

    def _await(self, done: Callable[[Status], bool], timeout_s: float, since_ns: int, otherwise: str) -> Status:
        sample = self._pump.wait_for(done, timeout_s, since_ns)
        self._require_wanted()
        if sample is None:
            raise self._silence(otherwise)
        return sample.status

    def _require_wanted(self) -> None:
        if self._pump.halts != self._halts:
            raise DeviceFault(self._device, "stop() interrupted the arming", remedy="arm() it again")

    def _silence(self, what: str) -> DeviceError:
        cause = self._pump.error
        if cause is not None:
            return type(cause)(self._device, f"{what}: {cause.problem}", remedy=cause.remedy, code=cause.code)
        newest = self._pump.newest
        if newest is not None and blocks(newest.status.fault):
            return device_fault(self._device, newest.status.fault, newest.status.controller_fault)
        return DeviceTimeout(self._device, what, remedy="free the fingers, check the 24 V supply, and arm() again")
