"""Serve mocks: read options and faults, print the addresses, shut down cleanly."""

from __future__ import annotations

import contextlib
import json
import signal
import sys
import threading
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lsds.clock import WallClock
from lsds.config import load_config
from lsds.config.overrides import parse_value
from lsds.contracts.backend import BuildContext
from lsds.contracts.wire import ObservedMock
from lsds.errors import ConfigError, ConfigIssue, DataError, DeviceError

if TYPE_CHECKING:
    from lsds.contracts.wire import WireMock
    from lsds.registry.backends import Backend
    from lsds.registry.host import PluginHost


def serve(
    host: PluginHost, backend: Backend, given: Mapping[str, Any], *, seed: int, control: bool, as_json: bool
) -> None:
    """Build the mock, print its addresses, and serve until a signal or, with `control`, the end of standard input.

    Raises ConfigError for options that are not allowed, ConnectFailed if an address is in use.
    """
    model = host.options_model(backend)
    texts = set() if model is None else {name for name, field in model.model_fields.items() if field.annotation is str}
    table = options(given, texts)
    built: WireMock = host.build("wire_mock", backend.qualified_name, table, BuildContext(WallClock(), seed))
    stop = threading.Event()
    with _stopping_on_signals(stop):
        try:
            addresses = dict(built.start())
            _announce(backend.spec.name, addresses, as_json)
            if control:
                threading.Thread(target=_control, args=(built, stop), daemon=True).start()
            built.serve(stop)
        finally:
            built.close()


def serve_rig(path: Path, overrides: tuple[str, ...], *, as_json: bool) -> None:
    """Start all mocks of a config's cell and wait for a signal.

    Raises ConfigError if its cell starts none, ConnectFailed if one does not start, DeviceError if one stops.
    """
    from lsds.runtime.rig import build_cell

    config = load_config(path, overrides)
    cell = build_cell(config, WallClock())
    if not hasattr(cell, "start"):
        problem = f"'{config.cell.backend}' has no mocks to start"
        raise ConfigError(str(path), [ConfigIssue("cell.backend", problem, 'write backend = "wire"')])
    stop = threading.Event()
    with _stopping_on_signals(stop):
        try:
            started = cell.start()
            if as_json:
                click.echo(json.dumps({"ready": "rig", "addresses": started}))
            else:
                for name, addresses in started.items():
                    click.echo(f"{name}: " + ", ".join(f"{face} {address}" for face, address in addresses.items()))
                click.echo("Press Ctrl-C to stop all mocks.")
            sys.stdout.flush()
            while not stop.wait(0.5):
                if cell.broken:
                    raise DeviceError(f"mock {cell.broken}", "stopped unexpectedly", remedy="start it alone to see why")
        finally:
            cell.close()


def options(given: Mapping[str, Any], texts: Collection[str] = ()) -> dict[str, Any]:
    """Return the options table for the flags that click parsed; those of `texts` are text, whatever it looks like.

    Flags not given keep the model's defaults.
    """
    table: dict[str, Any] = {}
    for name, value in given.items():
        if value is None or value == ():
            continue
        if name == "faults":
            table[name] = [_fault(text) for text in value]
        else:
            table[name] = parse_value(value) if isinstance(value, str) and name not in texts else value
    return table


def _fault(text: str) -> dict[str, Any]:
    fault: dict[str, Any] = {}
    for part in text.split(","):
        key, separator, value = part.partition("=")
        if not separator:
            raise ConfigError("--fault", [ConfigIssue(part, "is not KEY=VALUE", "write kind=drop,probability=0.1")])
        fault[key.strip()] = parse_value(value.strip())
    return fault


def _announce(name: str, addresses: Mapping[str, str], as_json: bool) -> None:
    if as_json:
        click.echo(json.dumps({"ready": name, "addresses": addresses}))
    else:
        click.echo(f"{name} serves:")
        width = max(map(len, addresses))
        for face, address in addresses.items():
            click.echo(f"  {face:{width}}  {address}")
        click.echo("Press Ctrl-C to stop.")
    sys.stdout.flush()


def _control(built: WireMock, stop: threading.Event) -> None:
    """Answer one request per line; at the end of the input the mock stops, so that it cannot outlive its test."""
    try:
        for line in sys.stdin:
            if not line.strip():
                continue
            try:
                request = json.loads(line)
                if not isinstance(request, dict):
                    raise DataError("a request must be a JSON object")
                answer: dict[str, Any] = {"ok": True, **_answer(built, request)}
            except Exception as error:
                answer = {"ok": False, "error": str(error)}
            click.echo(json.dumps(answer))
            sys.stdout.flush()
    finally:
        stop.set()


def _answer(built: WireMock, request: dict[str, Any]) -> dict[str, Any]:
    """Carry out a request and return its result. A table without the key `request` is a fault that begins."""
    kind = request.get("request", "inject")
    unnamed = kind == "inject" and "name" not in request
    if not unnamed and not isinstance(built, ObservedMock):
        raise DataError(
            "this mock cannot end a fault or report; it lacks end_fault, received and truths (ObservedMock)"
        )
    if kind == "inject":
        built.inject({key: value for key, value in request.items() if key != "request"})
        return {}
    assert isinstance(built, ObservedMock)
    if kind == "end":
        built.end_fault(str(request.get("name", "")))
        return {}
    if kind == "received":
        frames = built.received(int(request.get("since", 0)))
        return {"frames": [{**frame._asdict(), "data": frame.data.hex()} for frame in frames]}
    if kind == "truths":
        return {"truths": [dict(truth) for truth in built.truths(int(request.get("since_ns", 0)))]}
    raise DataError(f"'{kind}' is no request; write inject, end, received or truths")


@contextlib.contextmanager
def _stopping_on_signals(stop: threading.Event) -> Iterator[None]:
    """Make SIGINT and SIGTERM stop the service cleanly. Does nothing outside the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    signals = (signal.SIGINT, signal.SIGTERM)
    before = {number: signal.signal(number, lambda *_: stop.set()) for number in signals}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
