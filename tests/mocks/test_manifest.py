import json
import os
import subprocess
import sys
from importlib import import_module
from pathlib import Path

from lsds_mocks.manifest import lsds_backends

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext


def load(target):
    module, name = target.split(":")
    return getattr(import_module(module), name)


def test_every_backend_builds_with_its_default_options():
    context = BuildContext(VirtualClock(), 0)
    for spec in lsds_backends():
        # Wire mocks run on real time, like their clients.
        assert spec.virtual_time != (spec.kind in ("wire_mock", "study", "fault") or spec.over_wire)
        assert spec.summary
        assert bool(spec.extra) == bool(spec.requires)
        assert not spec.hardware_verified
        options = load(spec.options)
        assert options.model_config["extra"] == "forbid"
        assert options.model_config["frozen"]
        assert all(f.description for f in options.model_fields.values())
        load(spec.factory)(options(), context)


def test_names():
    named = {(spec.kind, spec.name) for spec in lsds_backends()}
    assert {(kind, name) for kind, name in named if kind not in ("wire_mock", "fault")} == {
        ("cell", "mujoco"),
        ("cell", "simulated"),
        ("cell", "wire"),
        ("sensor", "mock-gelsight-mini"),
        ("gripper", "mock-hand-e"),
        ("arm", "mock-ur5e"),
        ("pose_source", "mock-truth-camera"),
    }
    assert {name for kind, name in named if kind == "wire_mock"} >= {"hand-e", "robotiq-2f-85", "robotiq-2f-140"}


def test_the_manifest_imports_nothing_heavy():
    code = (
        "import sys, lsds_mocks.manifest as m; m.lsds_backends();"
        "print([n for n in ('numpy', 'cv2', 'pydantic', 'lsds_mocks.cell') if n in sys.modules])"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


WITHOUT_NUMBA = """
import importlib, json, sys
sys.modules["numba"] = None  # as if it were not installed
from lsds.clock import VirtualClock
from lsds.contracts import BuildContext
from lsds.errors import PluginLoadError
from lsds_mocks.manifest import lsds_backends
from installed import installed_host
host, messages = installed_host(), {}
for spec in lsds_backends():
    for target in (spec.options, None if spec.requires else spec.factory):
        if target:
            importlib.import_module(target.split(":")[0])
    if spec.requires:
        try:
            host.build(spec.kind, spec.name, {}, BuildContext(VirtualClock(), 0))
        except PluginLoadError as error:
            messages[f"{spec.kind} {spec.name}"] = str(error)
print(json.dumps(messages))
"""


def test_without_numba_its_users_report_the_remedy_and_the_rest_works():
    folders = [str(Path(__file__).resolve().parents[1]), *sys.path]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(folders)}
    run = subprocess.run(
        [sys.executable, "-c", WITHOUT_NUMBA], env=environment, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    messages = json.loads(run.stdout)
    assert messages.keys() == {f"{spec.kind} {spec.name}" for spec in lsds_backends() if "numba" in spec.requires}
    assert "cell simulated" in messages
    assert all("needs numba" in text and "lsds-tactile[sim]" in text and "\n" not in text for text in messages.values())
    free = {spec.name for spec in lsds_backends() if not spec.requires and spec.kind != "fault"}
    assert free == {"hand-e", "robotiq-2f-85", "robotiq-2f-140", "ur5e"}
