"""Importing is cheap: the heavy libraries come with the command that needs them."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

HEAVY = {"cv2", "torch", "sklearn", "matplotlib", "scipy", "serial", "rtde_control", "onnxruntime"}


def modules_after(code):
    program = f"import json, sys\n{code}\nprint(json.dumps(sorted(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return {module.split(".")[0] for module in json.loads(done.stdout.splitlines()[-1])}


@pytest.mark.parametrize("code", ["import lsds", "import lsds.cli.main", "import lsds.errors, lsds.contracts"])
def test_the_top_imports_nothing_heavy(code):
    loaded = modules_after(code)
    assert not loaded & HEAVY
    assert not loaded & {"numpy", "pydantic", "pluggy", "hypothesis", "pytest"}


@pytest.mark.parametrize(
    "code", ["import lsds.config", "import lsds.runtime.rig", "from lsds.registry import PluginHost"]
)
def test_building_a_rig_imports_no_vision_and_no_test_library(code):
    assert not modules_after(code) & (HEAVY | {"hypothesis", "pytest"})


SHORT = ["task.settle_s=0.1", "task.lift_s=0.2", "task.hold_s=0.1", "cell.simulated.fidelity=winkler"]


def test_a_run_needs_no_research_and_no_training_library(tmp_path):
    """With the shipped detector and estimator, which were trained, and run by onnxruntime alone."""
    arguments = ["run", "--no-plot", "--json", "run.json", *(part for text in SHORT for part in ("--set", text))]
    program = f"import sys; from lsds.cli.main import main; print(main({arguments!r}), *sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=tmp_path)
    code, *modules = done.stdout.splitlines()[-1].split()
    assert code in ("0", "8"), "held or dropped"
    assert json.loads((tmp_path / "run.json").read_text())["cycles"] > 5
    # The manifest is imported to list the backends; it imports nothing else of its package.
    assert [name for name in modules if name.startswith("lsds_research.")] == ["lsds_research.manifest"]
    assert "onnxruntime" in modules
    assert not {"torch", "sklearn", "skl2onnx", "onnx", "pyarrow", "matplotlib"} & set(modules)


def best_ms(*command):
    """Return the quickest of several runs, in ms above that of an empty interpreter."""
    from time import perf_counter

    def once(arguments):
        begin = perf_counter()
        subprocess.run([sys.executable, *arguments], capture_output=True, check=True)
        return (perf_counter() - begin) * 1e3

    return min(once(command) for _ in range(5)) - min(once(["-c", "pass"]) for _ in range(5))


def test_import_takes_less_than_150_ms():
    assert best_ms("-c", "import lsds") < 150


def test_help_takes_less_than_300_ms():
    assert best_ms("-m", "lsds.cli.main", "--help") < 300
