"""The pages of docs/plugins: their code passes the checks of its kind, and works in a simulated lift."""

from __future__ import annotations

import contextlib
import importlib
import re
import socket
import sys
import threading
import time
from pathlib import Path

import pytest

from lsds.clock import WallClock
from lsds.config import load_config
from lsds.contracts import KINDS, BuildContext
from lsds.errors import ConfigError, ConnectFailed
from lsds.runtime.engine import Engine
from lsds.runtime.rig import Rig
from lsds.session.run import _run
from lsds.testing import Bench, run_checks

PAGES = Path(__file__).parents[2] / "docs" / "plugins"
BLOCK = re.compile(r"```python\n(.*?)```", re.DOTALL)
ELSEWHERE = {"cell", "study", "learner", "command"}
"""Kinds that docs/plugins.md explains, or that plugins do not add."""
WRITTEN = sorted(set(KINDS) - ELSEWHERE)
NOT_CHOSEN = {"fault", "wire_mock"}
"""Kinds without a section in a config, which are tested otherwise."""


@pytest.fixture
def backend(request, tmp_path, monkeypatch, installed_host):
    kind = request.param
    name = f"acme_{kind}"
    code = "\n\n".join(BLOCK.findall((PAGES / f"{kind}.md").read_text(encoding="utf-8")))
    (tmp_path / f"{name}.py").write_text(code, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    module = importlib.import_module(name)
    (spec,) = module.lsds_backends()
    installed_host.register(module, distribution=name, name=name)
    yield installed_host, spec
    sys.modules.pop(name, None)


def test_every_kind_has_a_page():
    assert {page.stem for page in PAGES.glob("*.md")} == set(WRITTEN)


@pytest.mark.parametrize("backend", WRITTEN, indirect=True)
def test_the_code_of_a_page_passes_the_checks(backend):
    host, spec = backend
    results = run_checks(Bench(spec.kind, spec.name, host=host))
    assert results
    assert [result.message for result in results if result.outcome == "failed"] == []


@pytest.mark.parametrize("backend", sorted(set(WRITTEN) - NOT_CHOSEN), indirect=True)
def test_the_code_of_a_page_lifts(backend):
    host, spec = backend
    config = load_config(None, [f"{spec.kind}.backend={spec.name}", "task.lift_s=1.0"], host=host)
    with Rig(config, host) as rig:
        rig.arm_devices()
        session = _run(rig, Engine(rig), None)
    assert session.fault is None
    assert session.summary["outcome"] == "held"


@pytest.fixture
def served(backend):
    """The wire mock of a page, served in a thread, and a function that makes a second one."""
    host, spec = backend

    def build(**options):
        return host.build(spec.kind, spec.name, options, BuildContext(WallClock()))

    server, stop = build(stroke_mm=80.0), threading.Event()
    port = int(server.start()["tcp"].rpartition(":")[2])
    thread = threading.Thread(target=server.serve, args=(stop,))
    thread.start()
    yield server, port, build
    stop.set()
    thread.join(2.0)
    assert not thread.is_alive()
    server.close()
    server.close()


def connected(port):
    return socket.create_connection(("127.0.0.1", port), 2.0)


@pytest.mark.parametrize("backend", ["wire_mock"], indirect=True)
def test_the_code_of_the_wire_mock_page_serves_a_client(served):
    _, port, build = served
    with connected(port) as client, client.makefile("rw") as lines:

        def ask(request):
            lines.write(f"{request}\n")
            lines.flush()
            return lines.readline().strip()

        assert ask("STATE") == "80.00 80.00"
        assert [ask(bad) for bad in ("MOVE nan", "MOVE 81", "MOVE", "")] == ["ERROR value"] * 2 + ["ERROR request"] * 2
        assert ask("MOVE 20") == "OK"
        time.sleep(0.05)
        aperture_mm, target_mm = map(float, ask("STATE").split())
        assert aperture_mm < 80.0
        assert target_mm == 20.0
        assert ask("HOLD") == "OK"
        held_mm = ask("STATE").split()
        assert held_mm[0] == held_mm[1]
    with pytest.raises(ConnectFailed, match="choose another with --port"):
        build(port=port).start()


@pytest.mark.parametrize("backend", ["wire_mock"], indirect=True)
def test_no_client_ends_the_wire_mock_of_the_page_and_a_fault_shows(served):
    server, port, _ = served
    with connected(port) as client:
        client.sendall(b"STA")
    with connected(port) as client:
        client.sendall(b"\xff" * 10_000)
        with contextlib.suppress(ConnectionResetError):
            assert client.recv(1) == b""
    with connected(port) as client:
        client.sendall(b"STATE\n")
        assert client.recv(100) == b"80.00 80.00\n"
        with pytest.raises(ConfigError, match="one of: silent"):
            server.inject({"kind": "on fire"})
        server.inject({"kind": "silent"})
        client.sendall(b"STATE\n")
        client.settimeout(0.2)
        with pytest.raises(TimeoutError):
            client.recv(100)


@pytest.mark.parametrize("backend", ["fault"], indirect=True)
def test_the_fault_of_its_page_ends_a_run_as_the_page_states(backend):
    host, spec = backend
    sessions = []
    for severity in (1, 5):
        fault = f'faults=[{{backend = "{spec.name}", severity = {severity}, at = "lift"}}]'
        with Rig(load_config(None, ["task.lift_s=1.0", fault], host=host), host) as rig:
            rig.arm_devices()
            sessions.append(_run(rig, Engine(rig), None))
    harmless, worst = sessions
    assert (harmless.fault, harmless.summary["outcome"]) == (None, "held")
    assert worst.summary["outcome"] == "fault"
    assert re.search("gripper.*no command asked for it", worst.summary["fault"])
    assert not worst.truths[-1].dropped
