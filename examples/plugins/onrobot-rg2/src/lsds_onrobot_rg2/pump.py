"""One cycle of talking to the gripper: read its status, and write what is due.

The gripper ignores a grip while it is busy. A command during a motion therefore stops the motion first and starts when
the busy flag is low. A thread (real gripper) or the plant (mock) calls `step` at a fixed rate.
"""

from __future__ import annotations

import threading
from typing import NamedTuple

from lsds.errors import DeviceError, ProtocolFault

from lsds_onrobot_rg2.bus import Bus
from lsds_onrobot_rg2.registers import (
    BLOCK,
    BLOCK_LENGTH,
    CONTROL,
    SPEC,
    STOP,
    TARGET_FORCE,
    Status,
    motion_words,
    status_of,
)

SETTLES_NS = 60_000_000
"""Time after a grip was written in which a low busy flag may precede the motion (ns), assumed."""


class Motion(NamedTuple):
    """A motion to send until `expires_ns`."""

    aperture_m: float
    force_n: float
    expires_ns: int


class Pump:
    """The newest status, and the motion that is due. Safe from any thread; no request waits for a motion."""

    def __init__(self, device: str, bus: Bus) -> None:
        self._device = device
        self._bus = bus
        self._lock = threading.Lock()
        self._due: Motion | None = None
        self._stopping = False
        self._written: Motion | None = None
        self._running: Motion | None = None
        self._written_ns = 0
        self.status: Status | None = None
        self.error: DeviceError | None = None
        self.target_m: float | None = None

    def move(self, motion: Motion) -> None:
        """Have the next steps start a motion."""
        self._due, self._stopping, self.target_m = motion, False, motion.aperture_m

    def stop(self) -> None:
        """Cancel what is due and end the motion now; if that fails, the next steps try again. Raises DeviceError."""
        self._due, self._stopping = None, True
        with self._lock:
            self._written, self._running, self.target_m = None, None, None
            self._bus.write(CONTROL, [STOP])
            self._stopping = False

    def step(self, t_ns: int) -> None:
        """Do one cycle at a time. A failure is kept in `error`, and the newest status stays."""
        with self._lock:
            try:
                self.status = status = self._read(t_ns)
                self._act(t_ns, status)
                self.error = None
            except DeviceError as error:
                self.error = error

    def _read(self, t_ns: int) -> Status:
        block = self._bus.read(BLOCK, BLOCK_LENGTH)
        try:
            return status_of(t_ns, block)
        except ValueError as error:
            problem, remedy = f"the status shows {error}", "check that the gripper at this unit is an RG2"
            raise ProtocolFault(self._device, problem, remedy=remedy) from error

    def _act(self, t_ns: int, status: Status) -> None:
        due = self._due
        if due is not None and (status.fault is not None or t_ns >= due.expires_ns):
            self._forget(due)
            due = None
        if due is not None and self._is_under_way(due, status):
            self._take(due)
            due = None
        if self._stopping or (due is not None and status.busy):
            self._bus.write(CONTROL, [STOP])
            self._stopping, self._written, self._running = False, None, None
        elif self._written is not None and t_ns - self._written_ns < SETTLES_NS and not status.busy:
            return
        elif due is not None:
            self._write(t_ns, due)
            self._take(due)
        elif self._written is not None:
            self._confirm(t_ns, self._written, status)

    def _confirm(self, t_ns: int, written: Motion, status: Status) -> None:
        """Send a motion again that did not start: it came while the gripper was still busy."""
        started = status.busy or status.gripping or _has_arrived(status, written)
        if started or status.fault is not None or t_ns >= written.expires_ns:
            self._written = None
        else:
            self._write(t_ns, written)

    def _write(self, t_ns: int, motion: Motion) -> None:
        self._bus.write(TARGET_FORCE, motion_words(motion.aperture_m, motion.force_n))
        self._written = self._running = motion
        self._written_ns = t_ns

    def _is_under_way(self, due: Motion, status: Status) -> bool:
        """Whether the gripper does what is due already, so that a repeated command does not interrupt it."""
        running = self._running
        if running is None or running[:2] != due[:2]:
            return False
        return self._written is not None or status.busy or status.gripping or _has_arrived(status, due)

    def _take(self, due: Motion) -> None:
        if self._due is due:
            self._due = None

    def _forget(self, due: Motion) -> None:
        if self._due is due:
            self._due, self.target_m = None, None


def _has_arrived(status: Status, motion: Motion) -> bool:
    return abs(status.aperture_m - motion.aperture_m) <= 2 * SPEC.resolution_m
