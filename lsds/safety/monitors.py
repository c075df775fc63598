"""Monitors for a silent device, a gripper command that was lost, and an arm that does not follow.

They only compare times passed as arguments, so that every rule can be tested without a device.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from lsds.clock import seconds
from lsds.errors import SafetyStop

if TYPE_CHECKING:
    from lsds.contracts import ArmState, GripperState, Twist

#: A sample stamped further ahead of the rig's clock than this uses another clock, ns.
AHEAD_NS = 50_000_000


RECENT_SHARE = 0.25
"""A sample within this share of the limit is recent: three polls of a gripper at 60 Hz."""


class Freshness:
    """The time since the last usable sample of a source, on the rig's clock; its time stamps are checked.

    `limit_ns` is the longest time without a usable sample, `allowance_ns` an extra time at the start; `remedy` is shown
    if the source gave no reason. The loop asks many times within the limit; if it did not, the loop itself was late,
    and the error states that: samples may have come meanwhile.
    """

    #: A longer time without being asked, as a share of the limit, counts as lateness of the loop.
    AWAY_SHARE = 0.25

    def __init__(self, source: str, start_ns: int, limit_ns: int, *, allowance_ns: int = 0, remedy: str = "") -> None:
        self._source = source
        self._limit_ns = limit_ns
        self._remedy = remedy
        self._reason = ""
        self._good_ns = self._asked_ns = start_ns
        self._away_ns = 0
        self._allowance_ns = allowance_ns
        self._stamp_ns: int | None = None

    @property
    def reason(self) -> str:
        """The reason for the missing sample, empty if unknown."""
        return self._reason

    def is_recent(self, now_ns: int) -> bool:
        """Return whether the last usable sample came within a quarter of the limit."""
        return now_ns - self._good_ns <= RECENT_SHARE * self._limit_ns

    def good(self, now_ns: int) -> None:
        """Record a usable sample."""
        self._good_ns, self._allowance_ns, self._reason = now_ns, 0, ""
        self._asked_ns, self._away_ns = now_ns, 0

    def bad(self, reason: str) -> None:
        """Record the reason for a missing sample."""
        self._reason = reason

    def stamped(self, stamp_ns: int, now_ns: int) -> bool:
        """Record a sample's time stamp; return whether it is usable: newer than the last one, not in the future, and
        not too old on arrival."""
        last = self._stamp_ns
        if stamp_ns > now_ns + AHEAD_NS:
            self.bad(
                f"samples are stamped {seconds(stamp_ns - now_ns):.3f} s ahead of the rig's clock; stamp them by it"
            )
            return False
        self._stamp_ns = stamp_ns if last is None else max(last, stamp_ns)
        if last is not None and stamp_ns <= last:
            self.bad(
                "its newest sample is the previous one or is not stamped later; check whether the device still measures"
            )
            return False
        if now_ns - stamp_ns > self._limit_ns:
            self.bad(f"samples arrive {seconds(now_ns - stamp_ns):.3f} s after they were taken")
            return False
        return True

    def silence_s(self, now_ns: int) -> float:
        """Return for how long nothing usable has come (s), 0 within the limit."""
        silence = now_ns - self._good_ns
        return seconds(silence) if silence > self._limit_ns + self._allowance_ns else 0.0

    def require(self, now_ns: int) -> None:
        """Raise SafetyStop if there was no usable sample for too long."""
        silence = now_ns - self._good_ns
        since, self._asked_ns = now_ns - self._asked_ns, now_ns
        if since > self.AWAY_SHARE * self._limit_ns:
            self._away_ns += since
        if silence > self._limit_ns + self._allowance_ns:
            why = self._reason or f"no new sample came; {self._remedy}"
            if 2 * self._away_ns > silence:
                away = f"the loop itself was not run for {seconds(self._away_ns):.2f} s of it: the machine is busy"
                why = f"{away}; {why}"
            raise SafetyStop(
                f"{self._source}: nothing usable for {seconds(silence):.2f} s, the limit is "
                f"{seconds(self._limit_ns + self._allowance_ns):.2f} s ({why})"
            )


class ArrivalWatch:
    """Decides from the gripper's states whether it has executed a command.

    "Not moving" is not enough: it also holds before the motion starts, and if the command was lost.
    """

    #: The gripper has arrived when it has rested this long.
    REST_NS = 150_000_000
    #: A command that is not echoed for this long is lost.
    ECHO_NS = 500_000_000

    def __init__(self, resolution_m: float) -> None:
        self._near_m = 2 * resolution_m
        self._sent_m = math.nan
        self._sent_ns = 0
        self._heard = False
        self._resting_since: int | None = None

    def sent(self, aperture_m: float, now_ns: int) -> None:
        """Record the aperture that was sent."""
        self._sent_m, self._sent_ns, self._heard, self._resting_since = aperture_m, now_ns, False, None

    def superseded(self) -> None:
        """Record that a correction was sent since: the command must not be sent again, because that could open."""
        self._heard = True

    def lost(self, state: GripperState | None, now_ns: int) -> bool:
        """Return whether the gripper has not echoed the command in time. A command that was echoed once is never lost:
        a correction may have changed the target since, and sending it again would open the gripper."""
        if state is not None and self._echoes(state):
            self._heard = True
        return not self._heard and now_ns - self._sent_ns > self.ECHO_NS

    def arrived(self, state: GripperState | None, now_ns: int) -> bool:
        """Return whether the fingers rest at the target, or on an object on the way there."""
        if state is None or math.isnan(self._sent_m) or state.t_ns <= self._sent_ns or not self._echoes(state):
            self._resting_since = None
            return False
        if state.moving:
            self._resting_since = None
            return False
        if self._resting_since is None:
            self._resting_since = now_ns
        on_target = abs(state.aperture_m - self._sent_m) <= self._near_m
        return (on_target or state.contact.value == "closing") and now_ns - self._resting_since >= self.REST_NS

    def _echoes(self, state: GripperState) -> bool:
        return abs(state.target_m - self._sent_m) <= self._near_m


class FollowWatch:
    """Detects an arm that accepts velocity commands but does not move."""

    #: Time allowed until the arm moves, and the fraction of the commanded speed that counts as moving.
    PATIENCE_NS = 1_000_000_000
    SHARE = 0.3

    def __init__(self, lifetime_ns: int) -> None:
        """`lifetime_ns`: how long a command lives. A loop that is run less often lets commands expire."""
        self._lifetime_ns = lifetime_ns
        self._lagging_since: int | None = None
        self._run_ns: int | None = None
        self._away_ns = 0

    def run(self, now_ns: int) -> None:
        """Record that the loop is run now, with or without a new state."""
        if self._run_ns is not None:
            self._away_ns = max(self._away_ns, now_ns - self._run_ns)
        self._run_ns = now_ns

    def check(self, state: ArmState, commanded: Twist, now_ns: int) -> None:
        """Raise SafetyStop on a protective stop, or if the arm has not followed for too long."""
        if state.protective_stop:
            raise SafetyStop("arm: protective stop (find the cause, then unlock the arm)")
        wanted, speed, unit = math.hypot(*commanded.linear_m_s), math.hypot(*state.tcp_twist.linear_m_s), "m/s"
        if wanted <= 0:
            wanted, speed = math.hypot(*commanded.angular_rad_s), math.hypot(*state.tcp_twist.angular_rad_s)
            unit = "rad/s"
        if wanted <= 0 or speed >= self.SHARE * wanted:
            self._lagging_since, self._away_ns = None, 0
            return
        if self._lagging_since is None:
            self._lagging_since = now_ns
        if now_ns - self._lagging_since > self.PATIENCE_NS:
            why = "check remote control and obstacles"
            if self._away_ns > self._lifetime_ns:
                # Commands have expired, and the arm has stopped as it has to.
                why = (
                    f"the loop itself was not run for up to {seconds(self._away_ns):.2f} s: something in it is too slow"
                )
            raise SafetyStop(
                f"arm: commanded {wanted:.3f} {unit} but moving at {speed:.3f} {unit} for "
                f"{seconds(now_ns - self._lagging_since):.1f} s ({why})"
            )
