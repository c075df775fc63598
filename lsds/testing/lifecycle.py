"""Checks of a device's life cycle, the same for every kind."""

from __future__ import annotations

import threading
from typing import Any

from lsds.contracts.devices import Lifecycle
from lsds.errors import LifecycleError, StaleData
from lsds.testing.audit import audited
from lsds.testing.bench import FIRST_SAMPLE_S, Bench
from lsds.testing.expect import assert_raises

STOP_BOUND_S = 2.0
"""Maximum real time of `stop`, s."""

_OUTSIDE = ("socket.connect", "socket.bind", "subprocess.Popen", "os.posix_spawn", "pty.spawn", "os.openpty")


def check_constructing_does_no_io(bench: Bench) -> None:
    """Constructing opens no device, socket or process and starts no thread; the device is NEW."""
    bench.build().close()  # Build once before, so that lazy imports of the factory are not counted.
    threads = set(threading.enumerate())
    with audited(described) as calls:
        device = bench.build()
    try:
        assert not calls, f"the constructor accessed: {calls}; open it in connect()"
        assert set(threading.enumerate()) <= threads, "constructing started a thread; start it in connect()"
        _assert_is(device, Lifecycle.NEW)
    finally:
        device.close()


def check_walks_through_its_life(bench: Bench) -> None:
    """NEW, CONNECTED, ARMED, CONNECTED, CLOSED; a second disarm or close does nothing."""
    device = bench.build()
    device.connect()
    _assert_is(device, Lifecycle.CONNECTED)
    device.disarm()
    _assert_is(device, Lifecycle.CONNECTED, "disarm of a device that is not armed must do nothing")
    if bench.may_move:
        device.arm()
        _assert_is(device, Lifecycle.ARMED)
        device.disarm()
        _assert_is(device, Lifecycle.CONNECTED)
    device.close()
    _assert_is(device, Lifecycle.CLOSED)
    device.close()
    _assert_is(device, Lifecycle.CLOSED)


def check_closed_is_final(bench: Bench) -> None:
    """After close every call but stop, disarm and close raises LifecycleError."""
    device = bench.build()
    device.connect()
    device.close()
    for call in (device.connect, device.arm, device.read):
        assert_raises(call, LifecycleError, f"{call.__name__}() of a closed device")
    device.stop()
    device.disarm()
    _assert_is(device, Lifecycle.CLOSED)


def check_refuses_before_connect(bench: Bench) -> None:
    """A device that is not connected can be neither read nor armed, and can be closed."""
    device = bench.build()
    for call in (device.read, device.arm):
        assert_raises(call, LifecycleError, f"{call.__name__}() before connect()")
    device.close()
    _assert_is(device, Lifecycle.CLOSED)


def check_connects_once(bench: Bench) -> None:
    """Connecting a connected device raises LifecycleError and leaves it readable."""
    with bench.device() as device:
        assert_raises(device.connect, LifecycleError, "a second connect()")
        _assert_is(device, Lifecycle.CONNECTED)
        bench.read(device)


def check_stops_from_any_state_and_thread(bench: Bench) -> None:
    """`stop` returns in bounded time, twice, from another thread, in every state, and closes nothing."""
    states = [Lifecycle.NEW, Lifecycle.CONNECTED] + ([Lifecycle.ARMED] if bench.may_move else [])
    for state in states:
        with bench.device(state) as device:
            for _ in range(2):
                _stop_in_thread(device)
            assert device.lifecycle is not Lifecycle.CLOSED, (
                f"stop() closed a device that was {state.value}; only end its motion"
            )
    with bench.device() as device:
        device.close()
        _stop_in_thread(device)


def check_reads_soon_after_connect(bench: Bench) -> None:
    """A first sample arrives within seconds after connect."""
    with bench.device() as device:
        try:
            bench.read(device)
        except StaleData as error:
            raise AssertionError(f"no sample came within {FIRST_SAMPLE_S} s after connect(): {error}") from error


def _assert_is(device: Any, wanted: Lifecycle, why: str = "") -> None:
    found = device.lifecycle
    assert found is wanted, f"the device is {found.value}, expected {wanted.value}" + (f": {why}" if why else "")


def _stop_in_thread(device: Any) -> None:
    errors: list[BaseException] = []

    def call() -> None:
        try:
            device.stop()
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=call, daemon=True)
    thread.start()
    thread.join(STOP_BOUND_S)
    assert not thread.is_alive(), f"stop() did not return within {STOP_BOUND_S} s"
    assert not errors, f"stop() raised {errors[0]!r}"


def described(event: str, arguments: tuple[Any, ...]) -> str:
    """Return the text of an access outside the process, "" for any other event."""
    if event in _OUTSIDE:
        return f"{event} {arguments[:2]}"
    if event == "open" and str(arguments[0]).startswith("/dev/") and arguments[0] != "/dev/urandom":
        return f"open {arguments[0]}"
    return ""


LIFECYCLE_CHECKS = (
    check_constructing_does_no_io,
    check_walks_through_its_life,
    check_closed_is_final,
    check_refuses_before_connect,
    check_connects_once,
    check_stops_from_any_state_and_thread,
    check_reads_soon_after_connect,
)
