"""Records the traces of an algorithm: files, sockets and processes opened, clocks read, global state changed."""

from __future__ import annotations

import os
import random
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from types import FrameType
from typing import Any

import numpy as np

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


def global_state() -> dict[str, Any]:
    """Return the process-wide state that an algorithm must leave as it is."""
    name, keys, *rest = np.random.get_state(legacy=True)  # noqa: NPY002 - this is what must not change
    return {
        "numpy's global random state": (name, np.asarray(keys).tobytes(), *rest),
        "numpy's error state": np.geterr(),
        "the state of random": random.getstate(),
        "the working directory": os.getcwd(),
        "the environment": dict(os.environ),
    }


@contextmanager
def kept_state() -> Iterator[None]:
    """Put random states, error state, working directory and environment back afterwards."""
    numpy_state, state, folder = np.random.get_state(), random.getstate(), os.getcwd()  # noqa: NPY002
    environment = dict(os.environ)
    with np.errstate():
        try:
            yield
        finally:
            np.random.set_state(numpy_state)  # noqa: NPY002
            random.setstate(state)
            os.chdir(folder)
            os.environ.clear()
            os.environ.update(environment)


@contextmanager
def global_seed(seed: int) -> Iterator[None]:
    """Seed the global random generators, and put them back afterwards."""
    with kept_state():
        np.random.seed(seed)  # noqa: NPY002
        random.seed(seed)
        yield
