"""Faults of the gripper: the reported one, and those that persist until a reset."""

from __future__ import annotations

from lsds.clock import NS_PER_S
from lsds_mocks.wire.robotiq.layout import Trouble

SILENCE_NS = NS_PER_S
"""Time without a request after which the gripper reports a loss of communication (ns)."""
REFRESH_NS = 5_000_000
"""Refresh period of the status registers: 200 Hz."""
PASSING_NS = NS_PER_S // 2
"""Duration of a self-clearing fault after its last injection (ns)."""

NEEDS_RESET = frozenset(
    {
        Trouble.UNDER_VOLTAGE,
        Trouble.RELEASING,
        Trouble.INTERNAL,
        Trouble.ACTIVATION,
        Trouble.OVER_CURRENT,
        Trouble.RELEASED,
    }
)


class Health:
    """Latched, self-clearing and communication faults; the gripper reports the most severe one."""

    def __init__(self) -> None:
        self.latched = Trouble.NONE
        self.controller = 0
        self._hot_until = self._silence_until = self._other_until = -1
        self._other = Trouble.NONE
        self._heard_ns: int | None = None

    def heard(self, now_ns: int) -> None:
        """Record a request. The first request after a silence still gets the loss of communication reported."""
        if self._heard_ns is not None and now_ns - self._heard_ns >= SILENCE_NS:
            self._silence_until = now_ns + REFRESH_NS
        self._heard_ns = now_ns

    def passing(self, code: Trouble, now_ns: int) -> None:
        """Report a fault that clears by itself."""
        if code is Trouble.HOT:
            self._hot_until = now_ns + PASSING_NS
        elif code is Trouble.SILENCE:
            self._silence_until = now_ns + PASSING_NS
        else:
            self._other, self._other_until = code, now_ns + PASSING_NS

    def reset(self) -> None:
        """Clear the faults that a reset clears; overheating persists."""
        self.latched, self.controller = Trouble.NONE, 0

    def hot(self, now_ns: int) -> bool:
        """Whether the gripper is too hot to move."""
        return now_ns < self._hot_until

    def shown(self, now_ns: int, minor: Trouble) -> int:
        """Return the fault byte; `minor` is the minor fault of the last command."""
        code = self.latched
        if code is Trouble.NONE:
            if self.hot(now_ns):
                code = Trouble.HOT
            elif minor is not Trouble.NONE:
                code = minor
            elif now_ns < self._other_until:
                code = self._other
            elif now_ns < self._silence_until:
                code = Trouble.SILENCE
        return self.controller << 4 | code
