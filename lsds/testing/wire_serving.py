"""How the kit runs a wire mock: built on free addresses, served in a thread, ended in bounded time."""

from __future__ import annotations

import gc
import socket
import sys
import tempfile
import threading
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import cv2

from lsds.clock import WallClock
from lsds.contracts import BuildContext
from lsds.testing.bench import Bench
from lsds.testing.free_addresses import LOOPBACK, allows, has_own_host, random_host
from lsds.testing.wire_clients import Endpoint, client_of, endpoint_of

ENDED_S = 2.0
"""Time within which `serve` has to return after `stop` is set, and `close` after that, s of real time."""


class Served:
    """A wire mock that has started and serves in a thread. `error` is what ended `serve`, if it raised."""

    def __init__(self, mock: Any) -> None:
        self.mock = mock
        self.addresses: Mapping[str, str] = mock.start()
        self.error: BaseException | None = None
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="serve", daemon=True)
        self._thread.start()

    @property
    def endpoints(self) -> dict[str, Endpoint]:
        """The endpoint of each face. Raises AssertionError for an invalid address."""
        assert isinstance(self.addresses, Mapping), (
            f"start() returned {type(self.addresses).__name__}; return a dict of face and address"
        )
        assert self.addresses, "start() returned no address; return the address of each face by its name"
        found = {}
        for face, address in self.addresses.items():
            endpoint = endpoint_of(address) if isinstance(address, str) else None
            assert endpoint is not None, (
                f"start() returned {address!r} as the address of {face!r}; return HOST:PORT, scheme://HOST:PORT or the "
                "path of a socket or terminal that exists"
            )
            found[str(face)] = endpoint
        return found

    def require_serving(self, after: str) -> None:
        """Raise AssertionError if `serve` has returned or raised."""
        self._thread.join(0.05)
        raised = f" with {type(self.error).__name__}: {self.error}" if self.error is not None else ""
        assert self._thread.is_alive(), (
            f"serve() ended{raised} after {after}; handle OSError and wrong bytes for each client, and go on serving"
        )

    def end(self) -> None:
        """Stop and close it. Raises AssertionError if that takes too long or raises."""
        self._stop.set()
        self._thread.join(ENDED_S)
        serving = self._thread.is_alive()
        closing = Call(self.mock.close)
        assert not serving, (
            f"serve() did not return within {ENDED_S} s after stop was set; wait with a time limit, and look at stop"
        )
        assert closing.ended, f"close() did not return within {ENDED_S} s; close sockets and wait with a time limit"
        assert closing.error is None, f"close() raised {closing.error!r}; release what there is and return"

    def _serve(self) -> None:
        try:
            self.mock.serve(self._stop)
        except BaseException as error:
            self.error = error


@contextmanager
def connected(running: Served) -> Iterator[None]:
    """Hold a client at every face."""
    with ExitStack() as links:
        for endpoint in running.endpoints.values():
            links.enter_context(client_of(endpoint))
        yield


class Call:
    """A call in its own thread: whether it `ended` within `ENDED_S`, and the `error` that it raised."""

    def __init__(self, call: Any) -> None:
        self.error: BaseException | None = None
        thread = threading.Thread(target=self._run, args=(call,), daemon=True)
        thread.start()
        thread.join(ENDED_S)
        self.ended = not thread.is_alive()

    def _run(self, call: Any) -> None:
        try:
            call()
        except BaseException as error:
            self.error = error


@contextmanager
def free_options(bench: Bench) -> Iterator[dict[str, Any]]:
    """Yield options with free ports, a separate host and a socket in a new folder, if the mock has these options.

    The bench's own options take precedence.
    """
    model = bench.host.options_model(bench.host.find(bench.kind, bench.name))
    fields = {} if model is None else dict(model.model_fields)
    with tempfile.TemporaryDirectory(prefix="lsds-") as folder:
        candidates: dict[str, Any] = {}
        for name, field in fields.items():
            if name == "port" or name.endswith("_port"):
                if allows(field, 0):
                    candidates[name] = _free_port()
            elif has_own_host(name, field):
                candidates[name] = random_host()
            elif name == "socket":
                candidates[name] = str(Path(folder) / "mock.sock")
        yield {**candidates, **bench.options}


@contextmanager
def built(bench: Bench, options: Mapping[str, Any]) -> Iterator[Any]:
    """Yield a mock that has not started; it is always closed, and the process is as it was before."""
    with _kept_process():
        mock = bench.host.build(bench.kind, bench.name, options, BuildContext(WallClock(), 7))
        try:
            yield mock
        finally:
            with suppress(Exception):
                mock.close()


@contextmanager
def served(bench: Bench, options: Mapping[str, Any]) -> Iterator[Served]:
    """Yield a mock that serves; it is ended afterwards, in bounded time. Raises AssertionError."""
    with built(bench, options) as mock:
        running = Served(mock)
        try:
            yield running
        except BaseException:
            with suppress(AssertionError):  # Report the first error, not that of end().
                running.end()
            raise
        running.end()


@contextmanager
def _kept_process() -> Iterator[None]:
    """Put the garbage collector and the interval of threads back: a mock may tune the process, which is its own."""
    interval_s, collects, threads = sys.getswitchinterval(), gc.isenabled(), cv2.getNumThreads()
    try:
        yield
    finally:
        sys.setswitchinterval(interval_s)
        cv2.setNumThreads(threads)
        gc.unfreeze()
        if collects:
            gc.enable()


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])
