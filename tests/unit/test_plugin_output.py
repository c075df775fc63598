"""Plugins that print, or change the process, while they are imported."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import warnings
from types import SimpleNamespace

import pytest
from fake_cell import plugin

from lsds.cli import plugins as plugins_module
from lsds.cli.main import main
from lsds.clock import VirtualClock
from lsds.config import json_schema
from lsds.contracts import BackendSpec, BuildContext
from lsds.errors import PluginLoadError
from lsds.registry import PluginHost
from lsds.registry.containment import contained

NOISY = """
import os, sys
print("hello from acme")
os.write(1, b"bytes from acme\\n")
from lsds.contracts import BackendSpec
from lsds.registry import hookimpl

@hookimpl
def lsds_backends():
    print("the hook prints")
    return [BackendSpec("gripper", "acme", "acme_noisy:Gripper", "acme_driver:Options")]
"""
DRIVER = """
import os
print("driver says hello")
os.write(1, b"driver bytes\\n")
from pydantic import BaseModel

class Options(BaseModel):
    port: str = ""
"""
FACTORY = """
import ctypes, os
print("the factory prints")
from lsds.contracts import BackendSpec
from lsds.registry import hookimpl
from pydantic import BaseModel, field_validator

class Options(BaseModel):
    gain: float = 1.0

    @field_validator("gain")
    @classmethod
    def prints(cls, gain):
        print("the validator prints")
        return gain

def controller(options, context):
    print("the factory prints")
    os.write(1, b"the factory writes bytes\\n")
    ctypes.CDLL(None).puts(b"the factory calls C")
    return Controller()

class Controller:
    def update(self, state):
        return None

    def reset(self):
        pass

@hookimpl
def lsds_backends():
    return [BackendSpec("controller", "acme", "acme_factory:controller", "acme_factory:Options")]
"""
PROGRAM = """
import sys
from types import SimpleNamespace
from importlib.metadata import EntryPoint
import lsds.registry.host as host
from lsds.cli.main import main
manifests = sys.argv.pop(1).split(",")
host.installed_entry_points = lambda group: [EntryPoint(name, name, "lsds") for name in manifests]
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture
def program(tmp_path):
    """Run a command of lsds, with the printing plugin as the only one, in a separate process."""
    (tmp_path / "acme_noisy.py").write_text(NOISY)
    (tmp_path / "acme_driver.py").write_text(DRIVER)

    (tmp_path / "acme_factory.py").write_text(FACTORY)

    def run(*arguments, manifests="acme_noisy"):
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
        return subprocess.run(
            [sys.executable, "-c", PROGRAM, manifests, *arguments],
            capture_output=True,
            text=True,
            env=environment,
            cwd=tmp_path,
            check=True,
        )

    return run


def test_a_plugin_that_prints_does_not_corrupt_json(program):
    listed = json.loads(program("plugins", "--json", "-").stdout)
    assert [backend["name"] for backend in listed["backends"]] == ["acme"]
    (note,) = listed["notes"]
    assert note["plugin"] == "acme_noisy"
    for text in ("hello from acme", "bytes from acme", "the hook prints"):
        assert text in note["text"]
    schema = json.loads(program("config", "schema").stdout)
    assert "port" in schema["properties"]["gripper"]["properties"]["acme"]["properties"]


RIG = [
    part
    for setting in ("controller.backend=acme", "controller.acme.gain=2", "task.lift_s=0", "task.hold_s=0")
    for part in ("--set", setting)
]
WITH_MOCKS = "lsds_plugins.manifest,lsds_mocks.manifest,acme_factory"


@pytest.mark.parametrize(
    "arguments",
    [
        ("plugins", "--json", "-"),
        ("config", "schema"),
        ("run", *RIG, "--no-plot", "--json", "-"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_a_factory_that_prints_does_not_corrupt_json(program, arguments):
    done = program(*arguments, manifests=WITH_MOCKS)
    assert json.loads(done.stdout)
    if arguments[0] == "run":
        for text in ("the factory prints", "the factory writes bytes", "the factory calls C", "the validator prints"):
            assert text in done.stderr


def test_what_a_factory_prints_goes_to_stderr(capfd, monkeypatch):
    monkeypatch.setitem(sys.modules, "unit_output", sys.modules[__name__])
    host = PluginHost(entry_points=[])
    host.register(plugin(BackendSpec("controller", "c", "unit_output:noisy_controller")), distribution="d")
    out, folder = sys.stdout, os.getcwd()
    host.build("controller", "c", {}, BuildContext(VirtualClock()))
    printed = capfd.readouterr()
    assert printed.out == ""
    assert printed.err == "built\n"
    assert (sys.stdout, os.getcwd()) == (out, folder)


def test_stdout_is_back_after_a_factory_that_fails(capfd, monkeypatch):
    monkeypatch.setitem(sys.modules, "unit_output", sys.modules[__name__])
    host = PluginHost(entry_points=[])
    host.register(plugin(BackendSpec("controller", "c", "unit_output:failing_controller")), distribution="d")
    with pytest.raises(PluginLoadError, match="no gain"):
        host.build("controller", "c", {}, BuildContext(VirtualClock()))
    print("afterwards")
    os.write(1, b"bytes afterwards\n")
    assert sorted(capfd.readouterr().out.splitlines()) == ["afterwards", "bytes afterwards"]


def noisy_controller(options, context):
    print("built")
    return SimpleNamespace(update=lambda state: None, reset=lambda: None)


def failing_controller(options, context):
    print("before")
    raise ValueError("no gain")


def test_what_a_plugin_prints_is_listed_on_one_line(program):
    done = program("plugins")
    (line,) = [line for line in done.stdout.splitlines() if "printed while" in line]
    assert line.startswith("plugin acme_noisy (unknown): printed while loading: hello from acme")


def test_the_host_lists_output_of_a_backend_module_too(tmp_path, monkeypatch, capsys):
    (tmp_path / "acme_late.py").write_text("print('late')\nclass Thing: ...\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    host = PluginHost(entry_points=[])
    host.register(plugin(BackendSpec("gripper", "g", "acme_late:Thing")), distribution="d", name="p")
    host.imported(host.find("gripper", "g"))
    assert capsys.readouterr().out == ""
    (note,) = host.notes
    assert (note.plugin, note.distribution) == ("p", "d")
    assert note.text == "printed while importing acme_late: late"


def test_process_state_is_restored(tmp_path):
    out, err, cwd, filters = sys.stdout, sys.stderr, os.getcwd(), list(warnings.filters)
    with contained() as output:
        print("a\nb")
        os.chdir(tmp_path)
        warnings.simplefilter("error")
        sys.stdout = sys.stderr = None
    assert (sys.stdout, sys.stderr, os.getcwd(), list(warnings.filters)) == (out, err, cwd, filters)
    assert output.text == "a b"


def test_a_handler_that_keeps_the_stream_still_works_afterwards(capsys):
    with contained() as output:
        kept = sys.stdout
        kept.write("inside")
    kept.write("later\n")
    kept.flush()
    assert output.text == "inside"
    assert capsys.readouterr().out == "later\n"


def test_other_threads_keep_their_output(capsys):
    go, done = threading.Event(), threading.Event()

    def other():
        go.wait(5)
        print("other thread")
        done.set()

    thread = threading.Thread(target=other)
    thread.start()
    with contained() as output:
        print("plugin")
        go.set()
        done.wait(5)
    thread.join()
    assert output.text == "plugin"
    assert capsys.readouterr().out == "other thread\n"


def test_threads_that_load_plugins_at_the_same_time_leave_stdout_as_it_was():
    out = sys.stdout
    entered, left = threading.Event(), threading.Event()

    def second():
        with contained():
            entered.set()
            left.wait(5)

    thread = threading.Thread(target=second)
    with contained():
        thread.start()
        entered.wait(5)
    left.set()
    thread.join()
    assert sys.stdout is out


def test_a_long_output_is_shortened():
    with contained() as output:
        print("x" * 5000)
    assert len(output.text) <= 200
    assert output.text.endswith("...")


def test_plugins_lists_notes_as_a_field(monkeypatch, capsys):
    def load():
        print("hi")
        return plugin(BackendSpec("gripper", "g", "m:a"))

    entry = SimpleNamespace(name="p", dist=SimpleNamespace(name="d"), load=load)
    monkeypatch.setattr(plugins_module, "PluginHost", lambda: PluginHost(entry_points=[entry]))
    assert main(["plugins", "--json", "-"]) == 0
    (note,) = json.loads(capsys.readouterr().out)["notes"]
    assert note == {"plugin": "p", "distribution": "d", "text": "printed while loading: hi"}


def test_the_schema_survives_a_module_that_prints(tmp_path, monkeypatch, capsys):
    (tmp_path / "acme_opts.py").write_text("print('x')\nfrom pydantic import BaseModel\nclass O(BaseModel): ...\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    host = PluginHost(entry_points=[])
    host.register(plugin(BackendSpec("gripper", "g", "acme_opts:T", "acme_opts:O")), distribution="d")
    assert "g" in json_schema(host)["properties"]["gripper"]["properties"]
    assert capsys.readouterr().out == ""
