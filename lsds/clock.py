"""Time as data: the only module of the core that may read the wall clock or sleep.

All times are integer nanoseconds on a monotonic axis. Code below the command line is given a `Clock` and asks it.
"""

from __future__ import annotations

import time
from typing import Protocol, runtime_checkable

NS_PER_S = 1_000_000_000


def seconds(ns: int) -> float:
    """Return a duration in seconds."""
    return ns / NS_PER_S


def nanoseconds(s: float) -> int:
    """Return a duration in whole nanoseconds, rounded to nearest."""
    return round(s * NS_PER_S)


@runtime_checkable
class Clock(Protocol):
    """Where time comes from."""

    def now(self) -> int:
        """Return the present in nanoseconds; never goes back."""
        ...

    def sleep_until(self, t_ns: int) -> None:
        """Return when the present is at least `t_ns`; at once where it already is."""
        ...


class WallClock:
    """Real time: `time.monotonic_ns`, so that a clock set by an operator or NTP cannot move the loop."""

    virtual = False

    def now(self) -> int:
        """Return monotonic nanoseconds since some fixed past instant."""
        return time.monotonic_ns()

    def sleep_until(self, t_ns: int) -> None:
        """Sleep to an absolute deadline, which is what keeps a rate from drifting."""
        while (left := t_ns - time.monotonic_ns()) > 0:
            time.sleep(left / NS_PER_S)


class VirtualClock:
    """Simulated time: stands still until somebody sleeps, then jumps. Single-threaded by design."""

    virtual = True
    __slots__ = ("_now",)

    def __init__(self, start_ns: int = 0) -> None:
        self._now = start_ns

    def now(self) -> int:
        """Return simulated nanoseconds."""
        return self._now

    def sleep_until(self, t_ns: int) -> None:
        """Jump to `t_ns`; stay where that is in the past."""
        if t_ns > self._now:
            self._now = t_ns


perf_ns = time.perf_counter_ns
"""A high-resolution counter in nanoseconds, for measuring computing cost; never for deciding anything in the loop."""
