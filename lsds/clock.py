"""Clocks. This is the only module of the core that may read the wall clock or sleep.

All times are integer nanoseconds on a monotonic axis. Code below the command line reads the time from the `Clock` that
it is given.
"""

from __future__ import annotations

import time
from typing import Protocol, runtime_checkable

NS_PER_S = 1_000_000_000
"""Nanoseconds per second."""


def seconds(ns: int) -> float:
    """Return a duration in seconds."""
    return ns / NS_PER_S


def nanoseconds(s: float) -> int:
    """Return a duration in whole nanoseconds, rounded to nearest."""
    return round(s * NS_PER_S)


@runtime_checkable
class Clock(Protocol):
    """A source of time."""

    def now(self) -> int:
        """Return the present time in nanoseconds; never decreases."""
        ...

    def sleep_until(self, t_ns: int) -> None:
        """Wait until the time is at least `t_ns`; returns at once if it already is."""
        ...


class WallClock:
    """Real time: `time.monotonic_ns`, which is not affected when an operator or NTP sets the system clock."""

    virtual = False

    def now(self) -> int:
        """Return monotonic nanoseconds since a fixed instant in the past."""
        return time.monotonic_ns()

    def sleep_until(self, t_ns: int) -> None:
        """Sleep until an absolute deadline, so that a rate does not drift."""
        while (left := t_ns - time.monotonic_ns()) > 0:
            time.sleep(left / NS_PER_S)


def utc_s() -> float:
    """Return the calendar time in seconds since 1970, UTC: only to say when something was, never to measure."""
    return time.time()


class VirtualClock:
    """Simulated time: changes only when the program sleeps, and then jumps. For a single thread."""

    virtual = True
    __slots__ = ("_now",)

    def __init__(self, start_ns: int = 0) -> None:
        self._now = start_ns

    def now(self) -> int:
        """Return simulated nanoseconds."""
        return self._now

    def sleep_until(self, t_ns: int) -> None:
        """Jump to `t_ns`; does nothing if that is in the past."""
        if t_ns > self._now:
            self._now = t_ns


perf_ns = time.perf_counter_ns
"""A high-resolution counter in nanoseconds, for measuring computing time only, never for decisions in the loop."""
cpu_ns = time.process_time_ns
"""Computing time of this process, ns: other work on the machine does not count."""
