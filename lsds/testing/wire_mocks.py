"""Checks of wire mocks: no client ends the service, faults are named, and nothing is left of it."""

from __future__ import annotations

import re
import threading
from collections.abc import Mapping
from typing import Any

from lsds.errors import ConfigError, ConnectFailed
from lsds.testing.audit import audited
from lsds.testing.bench import Bench
from lsds.testing.leaks import RELEASED_S, held, remaining
from lsds.testing.lifecycle import described
from lsds.testing.outcomes import NotApplicable
from lsds.testing.wire_clients import CONNECTED_S, client_of, is_accepted, reset_on_close, send_garbage
from lsds.testing.wire_serving import ENDED_S, Call, Served, built, connected, free_options, served

UNKNOWN = "no-such-fault"
LEAVING_CLIENTS = 5
"""Number of clients that connect and leave, one after the other; chosen."""
_WORD = re.compile(r"[a-z][a-z0-9]*(?:[-_][a-z0-9]+)*")


def check_building_does_no_io(bench: Bench) -> None:
    """Constructing opens no socket, terminal or process and starts no thread; `close` of a new mock raises nothing."""
    with free_options(bench) as options:
        with built(bench, options):
            pass  # Once before, so that lazy imports of the factory are not counted.
        threads = set(threading.enumerate())
        with audited(described) as calls, built(bench, options) as mock:
            started = set(threading.enumerate()) - threads
            assert not calls, f"the constructor accessed {calls}; open it in start()"
            assert not started, f"constructing started {', '.join(map(str, started))}; start it in start()"
            _close(mock, "close() of a mock that has not started")


def check_start_names_its_addresses(bench: Bench) -> None:
    """`start` returns the address of each face by its name, and each can be connected to."""
    with free_options(bench) as options, served(bench, options) as running:
        for face, endpoint in running.endpoints.items():
            try:
                with client_of(endpoint):
                    pass
            except OSError as error:
                raise AssertionError(
                    f"face {face!r}: nothing answers at {running.addresses[face]}: {error}; listen in start(), and "
                    "return the address that is bound"
                ) from error


def check_serves_a_connection(bench: Bench) -> None:
    """`serve` accepts a client at every face within 2 s, and goes on while the client stays."""
    with free_options(bench) as options, served(bench, options) as running:
        for face in running.endpoints:
            _require_accepted(running, face, "the start")


def check_survives_clients_that_leave(bench: Bench) -> None:
    """Clients that connect and leave at once, or reset the connection, do not end it; the next one is accepted."""
    with free_options(bench) as options, served(bench, options) as running:
        for face, endpoint in running.endpoints.items():
            for i in range(LEAVING_CLIENTS):
                with client_of(endpoint) as link:
                    if i % 2:
                        reset_on_close(link)
                running.require_serving(f"a client left {face!r}")
            _require_accepted(running, face, f"{LEAVING_CLIENTS} clients that left")


def check_survives_garbage(bench: Bench) -> None:
    """A client that sends bytes of no protocol does not end it; the next one is accepted."""
    with free_options(bench) as options, served(bench, options) as running:
        for face, endpoint in running.endpoints.items():
            for i in range(LEAVING_CLIENTS):
                with client_of(endpoint) as link:
                    send_garbage(link, seed=i)
                    running.require_serving(f"garbage at {face!r}")
                running.require_serving(f"garbage at {face!r} and the client left")
            _require_accepted(running, face, f"{LEAVING_CLIENTS} clients that sent garbage")


def check_inject_names_the_kinds(bench: Bench) -> None:
    """`inject` of an unknown kind, or of none, raises a ConfigError with the kinds that there are, and serves on."""
    with free_options(bench) as options, served(bench, options) as running:
        for fault in ({}, {"kind": UNKNOWN}):
            error = _refused(running.mock, fault)
            running.require_serving(f"inject({fault})")
        message = str(error)
        words = [word for word in _WORD.findall(message) if word != UNKNOWN]
        known = "no faults" in message or any(_knows(running.mock, word, error) for word in words)
        assert known, (
            f"inject({{'kind': {UNKNOWN!r}}}) raises {message!r}, which names no kind that inject() takes; list the "
            "kinds in the remedy, or write that it has no faults"
        )


def check_refuses_an_address_in_use(bench: Bench) -> None:
    """`start` on addresses that another one serves raises ConnectFailed, and leaves the other serving."""
    with free_options(bench) as options, served(bench, options) as first:
        with built(bench, options) as second:
            before = held()
            try:
                addresses = dict(second.start())
            except ConnectFailed:
                _close(second, "close() after ConnectFailed")
                remains = remaining(before)
            except Exception as error:
                raise AssertionError(
                    f"start() on an address in use raised {type(error).__name__}: {error}; raise ConnectFailed from it"
                ) from error
            else:
                if not set(addresses.values()) & set(first.addresses.values()):
                    raise NotApplicable("it takes other addresses each time")
                raise AssertionError(
                    f"start() at {addresses}, which another one serves, did not raise; bind without SO_REUSEPORT, and "
                    "raise ConnectFailed"
                )
            assert not remains, (
                f"closed after ConnectFailed, it holds {', '.join(remains)}; close what start() has opened"
            )
        first.require_serving("another one had tried to start")


def check_ends_in_time(bench: Bench) -> None:
    """With clients connected, `serve` returns within 2 s after `stop` is set, and `close` within 2 s, also twice."""
    with free_options(bench) as options, built(bench, options) as mock:
        running = Served(mock)
        with connected(running):
            running.require_serving("a client connected")
            running.end()
            _close(mock, "a second close()")


def check_leaves_nothing(bench: Bench) -> None:
    """After `close` no file descriptor, socket, thread or child process is left, served or not."""
    with free_options(bench) as options:
        _live(bench, options)  # Once before, so that what libraries open at their first use is not counted.
        before = held()
        mock = _live(bench, options)  # The name keeps the mock: what only the collector releases is not released.
        remains = remaining(before)
        assert not remains, (
            f"{RELEASED_S} s after close() {type(mock).__name__} holds {', '.join(remains)}; release all"
        )
        with built(bench, options) as unserved:
            unserved.start()
            _close(unserved, "close() of a mock that never served")
            remains = remaining(before)
            assert not remains, f"closed without serve() it holds {', '.join(remains)}; release all in close()"


def check_starts_again(bench: Bench) -> None:
    """Once closed, a new one starts and serves at the same addresses at once, although a client was connected."""
    with free_options(bench) as options:
        for life in ("first", "second"):
            with built(bench, options) as mock:
                try:
                    running = Served(mock)
                except ConnectFailed as error:
                    raise AssertionError(
                        f"the {life} start() failed: {error}; close listeners in close(), and bind with SO_REUSEADDR"
                    ) from error
                with connected(running):
                    running.end()


def _require_accepted(running: Served, face: str, after: str) -> None:
    """Raise AssertionError if a new client of a face is not accepted."""
    endpoint = running.endpoints[face]
    try:
        with client_of(endpoint) as link:
            accepted = is_accepted(endpoint, link)
            running.require_serving(f"a client connected to {face!r}")
    except OSError as error:
        raise AssertionError(f"face {face!r} refuses a client after {after}: {error}; go on listening") from error
    assert accepted, (
        f"face {face!r} at {running.addresses[face]} has not accepted a client {CONNECTED_S} s after {after}; "
        "accept in serve(), and drop a client that has left"
    )


def _refused(mock: Any, fault: Mapping[str, Any]) -> ConfigError:
    """Return the ConfigError of a fault. Raises AssertionError for another error or none."""
    remedy = "raise ConfigError with the kinds that there are"
    try:
        mock.inject(fault)
    except ConfigError as error:
        return error
    except Exception as error:
        raise AssertionError(f"inject({fault}) raised {type(error).__name__}: {error}; {remedy}") from error
    raise AssertionError(f"inject({fault}) raised nothing; {remedy}")


def _knows(mock: Any, kind: str, unknown: ConfigError) -> bool:
    """Return whether a kind is taken, or refused for another reason than an unknown kind is."""
    try:
        mock.inject({"kind": kind})
    except ConfigError as error:
        return {issue.path for issue in error.issues} != {issue.path for issue in unknown.issues}
    return True


def _close(mock: Any, what: str) -> None:
    """Close a mock. Raises AssertionError if that takes too long or raises."""
    call = Call(mock.close)
    assert call.ended, f"{what} did not return within {ENDED_S} s; wait with a time limit"
    assert call.error is None, f"{what} raised {call.error!r}; release what there is and return"


def _live(bench: Bench, options: Mapping[str, Any]) -> Any:
    """Serve a mock with a client at every face, close it, and return it."""
    with built(bench, options) as mock:
        running = Served(mock)
        with connected(running):
            running.require_serving("a client connected")
            running.end()
    return mock


WIRE_MOCK_CHECKS = (
    check_building_does_no_io,
    check_start_names_its_addresses,
    check_serves_a_connection,
    check_survives_clients_that_leave,
    check_survives_garbage,
    check_inject_names_the_kinds,
    check_refuses_an_address_in_use,
    check_ends_in_time,
    check_leaves_nothing,
    check_starts_again,
)
