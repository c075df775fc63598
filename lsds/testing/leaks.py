"""Check that a closed device has released what it had opened: files, sockets, threads, child processes."""

from __future__ import annotations

import os
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any

from lsds.clock import WallClock, nanoseconds
from lsds.contracts.devices import Lifecycle
from lsds.testing.bench import Bench

RELEASED_S = 2.0
"""Time that threads and processes may need to end after `close`, s of real time."""
_DESCRIPTORS = Path("/proc/self/fd") if Path("/proc/self/fd").is_dir() else Path("/dev/fd")


def check_close_releases_everything(bench: Bench) -> None:
    """After `close` no file descriptor, socket, thread or child process of the device is left."""
    _live(bench)  # Run once before, so that files which libraries open on first use are not counted.
    before = held()
    device = _live(bench)  # Keep a reference: release by the garbage collector does not count.
    left = remaining(before)
    assert not left, (
        f"{RELEASED_S} s after close() the {device.lifecycle.value} device still holds {', '.join(left)}; "
        "release everything in close()"
    )


def _live(bench: Bench) -> Any:
    with bench.device(Lifecycle.ARMED if bench.may_move else Lifecycle.CONNECTED) as device:
        bench.read(device)
    return device


def remaining(before: dict[str, dict[object, str]]) -> list[str]:
    """Return what the process holds and did not before, once `RELEASED_S` have passed or nothing is left."""
    wall = WallClock()
    deadline = wall.now() + nanoseconds(RELEASED_S)
    while (left := _left(before, held())) and wall.now() < deadline:
        wall.sleep_until(wall.now() + nanoseconds(0.02))
    return left


def held() -> dict[str, dict[object, str]]:
    """Return what the process holds, by kind and identity, each with a text."""
    descriptors: dict[object, str] = {}
    for number in os.listdir(_DESCRIPTORS):
        with suppress(OSError):
            descriptors[number] = os.readlink(_DESCRIPTORS / number)
    threads: dict[object, str] = {thread: thread.name for thread in threading.enumerate()}
    children: dict[object, str] = {}
    for file in Path("/proc/self/task").glob("*/children"):
        with suppress(OSError):
            children.update({pid: pid for pid in file.read_text().split()})
    return {"file descriptor": descriptors, "thread": threads, "child process": children}


def _left(before: dict[str, dict[object, str]], after: dict[str, dict[object, str]]) -> list[str]:
    """Return what is held now and was not before."""
    return [f"{kind} {text}" for kind, held in after.items() for key, text in held.items() if key not in before[kind]]


LEAK_CHECKS = (check_close_releases_everything,)
