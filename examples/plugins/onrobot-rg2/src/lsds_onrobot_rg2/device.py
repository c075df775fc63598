"""The gripper as its registers show it, for both mocks. The fingers behind it are the plant's, or its own.

The mock knows only the protocol, so it repeats the addresses that the driver uses. Assumed: the fingertip offset counts
once for each finger, and the busy flag is high from the moment at which a grip is accepted.
"""

from __future__ import annotations

import threading

from lsds.clock import Clock, seconds
from lsds.contracts.plant_links import FingerLink, FingerState

WIDEST_TENTHS, GREATEST_TENTHS_N = 1100, 400
"""Ranges of the target registers: width (1/10 mm) and force (1/10 N)."""
LEAST_FORCE_N = 3.0
"""Smallest force that the gripper controls (N, data sheet)."""
SPEED_M_S = 0.1
"""Speed of the fingers (m/s), assumed."""
BUSY_AT_LEAST_NS = 30_000_000
"""Time for which the busy flag is high after a grip was accepted (ns), assumed."""
READABLE = (258, 263, 264, 267, 268, 275)
BLOCK = range(256, 276)
"""Registers that can be read; those that the guide does not list read zero."""
WRITABLE = (0, 1, 2, 1031)


class LoneFingers:
    """Fingers without a plant: they move to a target in free space, or close on an object of a given width."""

    def __init__(self, clock: Clock, stroke_m: float, object_m: float = 0.0) -> None:
        self._clock = clock
        self._object_m = object_m
        self._start_m = self._target_m = stroke_m
        self._start_ns, self._speed_m_s, self._limit_n = clock.now(), 0.0, 0.0

    def drive(self, target_m: float, speed_m_s: float, limit_n: float) -> None:
        """Start a motion from the present aperture."""
        self._start_m, self._start_ns = self.fingers().aperture_m, self._clock.now()
        self._target_m, self._speed_m_s, self._limit_n = target_m, speed_m_s, limit_n

    def hold(self) -> None:
        """Stay at the present aperture."""
        self._start_m = self._target_m = self.fingers().aperture_m

    def fingers(self) -> FingerState:
        """Return the state now."""
        now_ns = self._clock.now()
        end_m = max(self._target_m, min(self._object_m, self._start_m))
        left_m = end_m - self._start_m
        reach_m = self._speed_m_s * seconds(now_ns - self._start_ns)
        moving = abs(left_m) > reach_m
        aperture_m = self._start_m + (reach_m if left_m > 0 else -reach_m) if moving else end_m
        stalled = not moving and end_m > self._target_m
        return FingerState(now_ns, aperture_m, self._target_m, moving, stalled, self._limit_n if stalled else 0.0)

    def close(self) -> None:
        """Nothing to release."""


class Rg2Device:
    """Registers over a `FingerLink`. Safe from any thread."""

    def __init__(self, fingers: FingerLink, clock: Clock, offset_tenths: int = 0) -> None:
        self._fingers = fingers
        self._clock = clock
        self._lock = threading.RLock()
        self._force = self._width = 0
        self._offset = offset_tenths
        self._busy_until_ns = clock.now()
        self._safety = 0

    def read(self, address: int) -> int | None:
        """Return the value of a register, None if it cannot be read."""
        if address not in BLOCK:
            return None
        with self._lock:
            state = self._fingers.fingers()
            tenths = round(state.aperture_m * 1e4)
            if address == 268:
                return self._busy(state) | 2 * state.stalled | self._safety
            values = {258: self._offset, 267: tenths + 2 * self._offset, 275: tenths}
            return values.get(address, 0) & 0xFFFF

    def accepts(self, address: int, value: int) -> bool:
        """Whether a register can be written, with this value."""
        limits = {0: GREATEST_TENTHS_N, 1: WIDEST_TENTHS, 2: 16, 1031: 0xFFFF}
        return address in WRITABLE and value <= limits[address] and (address != 2 or value in (1, 8, 16))

    def write(self, address: int, value: int) -> None:
        """Write a register that `accepts` the value."""
        with self._lock:
            if address == 0:
                self._force = value
            elif address == 1:
                self._width = value
            elif address == 1031:
                self._offset = value - (value >> 15 << 16)
            elif value == 8:
                self._stop()
            else:
                self._grip(with_offset=value == 16)

    def trip(self, switch: int) -> None:
        """Push safety switch 1 or 2: the fingers stop, and the gripper does not move until it is switched off."""
        with self._lock:
            self._safety |= 0b11 << 2 * switch
            self._stop()

    def _stop(self) -> None:
        self._busy_until_ns = self._clock.now()
        if self._fingers.fingers().moving:
            self._fingers.hold()

    def _grip(self, *, with_offset: bool) -> None:
        if self._safety or self._busy(self._fingers.fingers()):
            return
        tenths = self._width if with_offset else self._width - 2 * self._offset
        aperture_m = min(max(tenths, 0), WIDEST_TENTHS) * 1e-4
        self._fingers.drive(aperture_m, SPEED_M_S, max(self._force * 0.1, LEAST_FORCE_N))
        self._busy_until_ns = self._clock.now() + BUSY_AT_LEAST_NS

    def _busy(self, state: FingerState) -> bool:
        return state.moving or self._clock.now() < self._busy_until_ns
