"""Checks of the time that calls take, and of the threads that they come from."""

from __future__ import annotations

import threading
from collections.abc import Callable
from statistics import median
from typing import Any

from lsds.clock import perf_ns
from lsds.contracts.devices import Lifecycle
from lsds.errors import StaleData
from lsds.testing.bench import Bench
from lsds.testing.machine import a_command

CALL_LIMIT_S = 0.1
"""Median real time of a call of `read`, `command` or `stop`."""
THREAD_S = 60.0
"""Time limit of a call in another thread, s; chosen."""
_CALLS = 9
"""Number of calls whose median counts; chosen."""


def check_calls_return_quickly(bench: Bench) -> None:
    """`read`, `command` and `stop` return within 0.1 s of real time (median), and in simulated time at once."""
    armed = bench.kind in ("gripper", "arm") and bench.may_move
    with bench.device(Lifecycle.ARMED if armed else Lifecycle.CONNECTED) as device:
        bench.read(device)
        _assert_quick(bench, "read", lambda: _read(device))
        if armed:
            _assert_quick(bench, "command", lambda: device.command(a_command(bench, bench.in_future(10.0))))
        _assert_quick(bench, "stop", device.stop)


def check_works_outside_the_main_thread(bench: Bench) -> None:
    """Connecting, reading, arming and commanding work in a thread other than the main one, and `close` in another."""
    armed = bench.kind in ("gripper", "arm") and bench.may_move
    device = bench.build()

    def use() -> None:
        # The thread stays alive while another one closes the device, so that their identifiers differ.
        try:
            work()
        finally:
            _in_thread(device.close, "close()")

    def work() -> None:
        device.connect()
        bench.read(device)
        if armed:
            device.arm()
            device.command(a_command(bench, bench.in_future()))
            device.disarm()

    _in_thread(use, "connect() and read()")


def _read(device: Any) -> None:
    try:
        device.read()
    except (StaleData, EOFError):
        return


def _assert_quick(bench: Bench, name: str, call: Callable[[], Any]) -> None:
    taken: list[float] = []
    for _ in range(_CALLS):
        before_ns, began = bench.clock.now(), perf_ns()
        call()
        taken.append((perf_ns() - began) * 1e-9)
        waited_s = (bench.clock.now() - before_ns) * 1e-9
        assert not (bench.virtual and waited_s), (
            f"{name}() let {waited_s} s of simulated time pass; return at once and let the caller wait"
        )
        if sum(one > CALL_LIMIT_S for one in taken) > _CALLS // 2:
            break
    typical_s = median(taken)
    assert typical_s <= CALL_LIMIT_S, (
        f"{name}() takes {typical_s:.2f} s of real time (median of {len(taken)}), and {CALL_LIMIT_S} s are allowed; "
        "talk to the device in a thread of your own"
    )


def _in_thread(call: Callable[[], Any], what: str) -> None:
    errors: list[BaseException] = []

    def run() -> None:
        try:
            call()
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(THREAD_S)
    assert not thread.is_alive(), f"{what} in a thread did not return within {THREAD_S:.0f} s"
    if errors and isinstance(errors[0], AssertionError):
        raise errors[0]
    assert not errors, (
        f"{what} in a thread raised {errors[0]!r}; the framework calls devices from threads, not from the main one"
    )


LATENCY_CHECKS = (check_calls_return_quickly, check_works_outside_the_main_thread)
