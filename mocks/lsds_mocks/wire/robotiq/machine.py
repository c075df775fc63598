"""The register machine of a Robotiq gripper: the effect of a written command, and the resulting status.

It does no I/O and reads no clock: every call passes the time (ns). It moves the fingers through a `FingerLink`.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING

from lsds.clock import NS_PER_S, nanoseconds
from lsds_mocks.devices.hand_e_units import HandEUnits, from_byte
from lsds_mocks.wire.robotiq import layout
from lsds_mocks.wire.robotiq.health import NEEDS_RESET, REFRESH_NS, Health
from lsds_mocks.wire.robotiq.layout import ACT, ARD, ATR, GTO, Activation, Detection, Trouble

if TYPE_CHECKING:
    from lsds.contracts.plant_links import FingerLink, FingerState
    from lsds_mocks.wire.robotiq.options import RobotiqOptions

_AT_TARGET_M = 1e-6
"""Largest difference at which the plant's target counts as the commanded aperture, m; chosen."""
_MOVING_COUNTS = 10
"""Current register (gCU) during free motion: the manual's frame of a closing gripper has 0x0A."""
_COUNTS_PER_N = 0.4
"""Increase of the current register per newton of normal force during motion, gCU/N; chosen."""
_FOREVER = 2**63
"""End of a permanent freeze, ns: later than any clock value."""


class RegisterMachine:
    """Steps through activation, motion, automatic release and faults.

    `clear` is called with True when an activation begins, to remove the object, and with False at its end.
    """

    def __init__(
        self,
        options: RobotiqOptions,
        link: FingerLink,
        now_ns: int,
        clear: Callable[[bool], None] = lambda _: None,
    ) -> None:
        self._link = link
        self._clear = clear
        self._stroke_m = options.stroke_mm * 1e-3
        self._units = HandEUnits(self._stroke_m, options.open_tick, options.closed_tick)
        self._speed_m_s = (options.slowest_mm_s * 1e-3, options.fastest_mm_s * 1e-3)
        self._force_n = (options.weakest_n, options.strongest_n)
        self._latency_ns = nanoseconds(options.latency_ms * 1e-3)
        self._activation_ns = nanoseconds(options.activation_s)
        self._command = bytearray(layout.BYTES)
        self._health = Health()
        self._activation = Activation.RESET
        self._phase: Callable[[FingerState, int], None] | None = None
        self._began_ns = now_ns
        self._want_m: float | None = None
        self._cool = True
        self._under_way: deque[tuple[int, Callable[[], None]]] = deque()
        self._frozen_until = -1
        self._refreshed = -1
        self._status = bytes(layout.BYTES)
        if options.activated:
            self._command[layout.ACTION_OFFSET] = ACT
            self._activation = Activation.ACTIVE
        else:
            clear(True)

    @property
    def command(self) -> bytes:
        """The command block as last written."""
        return bytes(self._command)

    @property
    def busy(self) -> bool:
        """Whether an activity is in progress that advances with time."""
        return self._phase is not None or bool(self._under_way) or not self._cool

    def status(self, now_ns: int) -> bytes:
        """Return the status block as last refreshed."""
        self.step(now_ns)
        if now_ns < self._frozen_until:
            return self._status
        if now_ns // REFRESH_NS != self._refreshed:
            self._refresh(now_ns)
        return self._status

    def heard(self, now_ns: int) -> None:
        """Record a client's request."""
        self._health.heard(now_ns)

    def write(self, offset: int, data: bytes, now_ns: int) -> None:
        """Write bytes into the command block; the command starts at once."""
        self.step(now_ns)
        if now_ns < self._frozen_until:
            return
        before = self.command
        self._command[offset : offset + len(data)] = data
        was, action = before[layout.ACTION_OFFSET], self._command[layout.ACTION_OFFSET]
        if not action & ACT:
            self._reset(now_ns)
        elif not was & ACT:
            self._activate(now_ns)
        elif action & ATR and not was & ATR:
            self._release(now_ns)
        elif self._can_go():
            self._obey(before, now_ns)
        self._refreshed = -1

    def step(self, now_ns: int) -> None:
        """Advance all activities to the present."""
        if now_ns < self._frozen_until:
            return
        while self._under_way and self._under_way[0][0] <= now_ns:
            self._under_way.popleft()[1]()
        if not self._cool and not self._health.hot(now_ns):
            self._cool = True
            self._go(now_ns)
        if self._phase is not None:
            self._phase(self._link.fingers(), now_ns)

    # -- faults -------------------------------------------------------------------------------------------

    def fail(self, code: int, now_ns: int) -> None:
        """Cause a fault; `code` is the complete fault byte. Raises ValueError for an unknown fault."""
        fault = Trouble(code & 0x0F)
        self._health.controller = code >> 4
        self._refreshed = -1
        if fault is Trouble.RELEASING:
            self._release(now_ns)
        elif fault in NEEDS_RESET:
            self._latch(fault)
        elif fault is Trouble.HOT:
            self._health.passing(fault, now_ns)
            if self._cool:
                self._halt()
            self._cool = False
        elif fault is not Trouble.NONE:
            self._health.passing(fault, now_ns)

    def freeze(self, until_ns: int | None) -> None:
        """Ignore commands and stop refreshing the status until a time, or permanently (None)."""
        self._frozen_until = _FOREVER if until_ns is None else until_ns

    # -- inside -------------------------------------------------------------------------------------------

    def _can_go(self) -> bool:
        return self._activation is Activation.ACTIVE and self._health.latched is Trouble.NONE

    def _reset(self, now_ns: int) -> None:
        if self._activation is not Activation.RESET or self._phase is not None:
            self._halt()
        self._activation, self._phase, self._want_m = Activation.RESET, None, None
        self._health.reset()

    def _latch(self, fault: Trouble) -> None:
        self._halt()
        self._phase, self._activation, self._want_m = None, Activation.RESET, None
        self._health.latched = fault

    def _halt(self) -> None:
        self._under_way.clear()
        self._link.hold()

    def _obey(self, before: bytes, now_ns: int) -> None:
        if not self._command[layout.ACTION_OFFSET] & GTO:
            self._want_m = None
            self._halt()
        elif not before[layout.ACTION_OFFSET] & GTO or before[3:6] != self._command[3:6]:
            self._go(now_ns)

    def _go(self, now_ns: int) -> None:
        """Start the motion that the command block requests, if any."""
        if not (self._can_go() and self._command[layout.ACTION_OFFSET] & GTO):
            return
        _, _, _, position, speed, force = self._command[:6]
        target = self._want_m = min(max(self._units.aperture_m(position), 0.0), self._stroke_m)
        if self._health.hot(now_ns):
            return
        speed_m_s, limit_n = from_byte(speed, self._speed_m_s), from_byte(force, self._force_n)
        if self._latency_ns:
            self._under_way.append((now_ns + self._latency_ns, lambda: self._link.drive(target, speed_m_s, limit_n)))
        else:
            self._link.drive(target, speed_m_s, limit_n)

    def _activate(self, now_ns: int) -> None:
        self._health.reset()
        self._activation, self._began_ns, self._want_m = Activation.ACTIVATING, now_ns, None
        self._phase = self._closing
        self._clear(True)
        self._link.drive(0.0, self._activation_speed, self._force_n[0])

    @property
    def _activation_speed(self) -> float:
        return 2 * self._stroke_m * NS_PER_S / self._activation_ns

    def _closing(self, fingers: FingerState, now_ns: int) -> None:
        if _stuck_towards(fingers, 0.0):
            self._latch(Trouble.ACTIVATION)
        elif now_ns - self._began_ns >= self._activation_ns // 2 and _rests_at(fingers, 0.0):
            self._phase = self._opening
            self._link.drive(self._stroke_m, self._activation_speed, self._force_n[0])

    def _opening(self, fingers: FingerState, now_ns: int) -> None:
        if _stuck_towards(fingers, self._stroke_m):
            self._latch(Trouble.ACTIVATION)
        elif now_ns - self._began_ns >= self._activation_ns and _rests_at(fingers, self._stroke_m):
            self._activation, self._phase = Activation.ACTIVE, None
            self._refreshed = -1
            self._clear(False)
            self._go(now_ns)

    def _release(self, now_ns: int) -> None:
        """Move slowly to the end in the requested direction; only a reset ends it."""
        if self._health.latched is Trouble.RELEASING:
            return
        self._under_way.clear()
        self._activation, self._want_m = Activation.RESET, None
        self._health.latched = Trouble.RELEASING
        target = self._stroke_m if self._command[layout.ACTION_OFFSET] & ARD else 0.0
        self._link.drive(target, self._speed_m_s[0], self._force_n[0])

        def releasing(fingers: FingerState, _now_ns: int) -> None:
            if _stuck_towards(fingers, target) or _rests_at(fingers, target):
                self._phase = None
                self._health.latched = Trouble.RELEASED
                self._refreshed = -1

        self._phase = releasing

    def _refresh(self, now_ns: int) -> None:
        self._refreshed = now_ns // REFRESH_NS
        fingers = self._link.fingers()
        action = self._command[layout.ACTION_OFFSET]
        minor = Trouble.NONE
        if action & GTO and not action & ACT:
            minor = Trouble.NOT_ACTIVATED
        elif action & GTO and self._activation is Activation.ACTIVATING:
            minor = Trouble.DELAYED
        self._status = layout.status_bytes(
            action,
            self._activation,
            self._detection(fingers),
            self._health.shown(now_ns, minor),
            self._command[layout.POSITION_OFFSET],
            self._units.tick(fingers.aperture_m),
            min(round((_MOVING_COUNTS + _COUNTS_PER_N * fingers.normal_n) if fingers.moving else 0), 255),
        )

    def _detection(self, fingers: FingerState) -> Detection:
        if self._want_m is None or self._under_way or abs(fingers.target_m - self._want_m) > _AT_TARGET_M:
            return Detection.MOVING
        if fingers.stalled:
            return Detection.CLOSING if self._want_m < fingers.aperture_m else Detection.OPENING
        return Detection.MOVING if fingers.moving else Detection.ARRIVED


def _stuck_towards(fingers: FingerState, aperture_m: float) -> bool:
    """Return whether an object blocks this motion; a plant in another process may still report the previous motion."""
    return abs(fingers.target_m - aperture_m) <= _AT_TARGET_M and fingers.stalled


def _rests_at(fingers: FingerState, aperture_m: float) -> bool:
    return abs(fingers.target_m - aperture_m) <= _AT_TARGET_M and not fingers.moving and not fingers.stalled
