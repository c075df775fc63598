import subprocess
import sys
from importlib import import_module

from lsds_mocks.manifest import lsds_backends

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext


def load(target):
    module, name = target.split(":")
    return getattr(import_module(module), name)


def test_every_backend_builds_with_its_default_options():
    context = BuildContext(VirtualClock(), 0)
    for spec in lsds_backends():
        # What is reached over a wire runs on real time: its clients do.
        assert spec.virtual_time != (spec.kind in ("wire_mock", "study") or spec.over_wire)
        assert spec.summary
        assert not spec.hardware_verified
        options = load(spec.options)
        assert options.model_config["extra"] == "forbid"
        assert options.model_config["frozen"]
        assert all(f.description for f in options.model_fields.values())
        load(spec.factory)(options(), context)


def test_names():
    named = {(spec.kind, spec.name) for spec in lsds_backends()}
    assert {(kind, name) for kind, name in named if kind != "wire_mock"} == {
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
