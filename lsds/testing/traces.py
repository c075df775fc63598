"""Records the traces of an algorithm: files, sockets and processes opened, clocks read."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from types import FrameType
from typing import Any

from lsds.testing.audit import audited

_OUTSIDE = (
    "open",
    "os.system",
    "os.fork",
    "os.posix_spawn",
    "os.listdir",
    "os.scandir",
    "subprocess.Popen",
    "pty.spawn",
)
_CLOCKS = ("time", "time_ns", "monotonic", "monotonic_ns", "localtime", "gmtime", "clock_gettime", "clock_gettime_ns")
_DATES = ("now", "utcnow", "today")


def io_calls() -> AbstractContextManager[list[str]]:
    """Record files, sockets and processes that are opened."""
    return audited(_described)


def _described(event: str, arguments: tuple[Any, ...]) -> str:
    return f"{event} {arguments[:2]}" if event in _OUTSIDE or event.startswith("socket.") else ""


@contextmanager
def clock_calls() -> Iterator[list[str]]:
    """Record calls that read the time of day or a monotonic clock, in this thread.

    Counters of computing time (`time.perf_counter`) are not recorded.
    """
    calls: list[str] = []

    def note(frame: FrameType, event: str, called: Any) -> None:
        if event != "c_call":
            return
        name, owner = getattr(called, "__name__", ""), getattr(called, "__self__", None)
        if getattr(called, "__module__", None) == "time" and name in _CLOCKS:
            calls.append(f"time.{name} in {frame.f_code.co_qualname}, line {frame.f_lineno}")
        elif name in _DATES and getattr(owner, "__module__", None) == "datetime":
            calls.append(f"datetime.{name} in {frame.f_code.co_qualname}, line {frame.f_lineno}")

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        yield calls
    finally:
        sys.setprofile(before)
