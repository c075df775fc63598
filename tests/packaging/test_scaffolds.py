"""`lsds new` writes a distribution that is clean, keeps its contracts and works when installed."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from importlib.metadata import distributions
from pathlib import Path

import pytest
from scaffolds import SOURCES, write_all

from lsds.cli.scaffold.names import names_of
from lsds.cli.scaffold.plan import PLANS
from lsds.cli.scaffold.write import write
from lsds.config import check_config
from lsds.runtime.engine import Engine
from lsds.runtime.rig import Rig
from lsds.testing import Bench, cases

pytest.importorskip("jinja2")
WITH_KIT = (
    "gripper",
    "arm",
    "sensor",
    "pose_source",
    "tracker",
    "detector",
    "estimator",
    "controller",
    "job",
    "fault",
    "wire_mock",
    "study",
    "command",
)
DEVICES = ("gripper", "arm", "sensor", "pose_source")
OWN_TESTS = (*DEVICES, "fault", "wire_mock", "study", "command")


@pytest.fixture(scope="module")
def scaffolds(tmp_path_factory):
    return write_all(tmp_path_factory.mktemp("scaffolds"))


@pytest.fixture
def importable(scaffolds, monkeypatch):
    """The scaffolds on the search path."""
    for kind in PLANS:
        monkeypatch.syspath_prepend(str(scaffolds.source(kind)))
    yield scaffolds
    packages = tuple(own.package for own in scaffolds.names.values())
    for module in [name for name in sys.modules if name.startswith(packages)]:
        del sys.modules[module]


def run(*command, path="", **more):
    done = subprocess.run(
        [sys.executable, "-m", *command],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, **({"PYTHONPATH": path} if path else {}), **more.pop("env", {})},
        **more,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def require(tool):
    if importlib.util.find_spec(tool) is None:
        pytest.skip(f"{tool} is not installed; it comes with the extra 'dev'")


def backend_of(kind):
    return f"{'mock-' if kind in DEVICES else ''}acme-{kind.replace('_', '-')}"


@pytest.mark.parametrize("kind", WITH_KIT)
def test_it_passes_the_kit(importable, kind):
    checks = cases(Bench(kind, backend_of(kind), host=importable.host(kind)))
    assert len(checks) >= 5
    for check in checks:
        check()


@pytest.mark.parametrize("kind", ["gripper", "arm", "sensor", "controller", "job", "tracker"])
def test_a_simulated_lift_holds(importable, kind):
    host = importable.host(kind)
    own = {kind: {"backend": backend_of(kind)}}
    with Rig(check_config({"seed": 1, "task": {"lift_s": 1.0}, **own}, "test", host), host) as rig:
        rig.arm_devices()
        Engine(rig, rig.job).run()
        truth = rig.cell.truth()
    assert not truth.dropped
    assert truth.object_height_m > 0.01
    assert truth.slip_distance_m < 0.010


def test_their_own_tests_pass(scaffolds):
    tests = [str(scaffolds.folder / kind / "tests") for kind in PLANS if kind not in WITH_KIT or kind in OWN_TESTS]
    # The kit has run in this process already.
    chosen = ["-k", "not keeps_its_contract", "-p", "no:cacheprovider", "-c", os.devnull]
    out = run("pytest", "-q", f"--rootdir={scaffolds.folder}", *chosen, *tests, path=scaffolds.path)
    assert "failed" not in out
    assert "passed" in out


def test_they_are_formatted_and_linted_whatever_the_length_of_the_name(scaffolds, tmp_path):
    require("ruff")
    for kind in PLANS:
        short = {"wire_mock": "w", "pose_source": "p"}.get(kind, kind[:5])
        for name in ("a", f"an-adversarially-long-name-{short}"[:30].rstrip("-")):
            write(names_of(kind, name), tmp_path / f"{kind}-{len(name)}")
    for folder in (scaffolds.folder, tmp_path):
        run("ruff", "check", "--no-cache", str(folder))
        run("ruff", "format", "--no-cache", "--check", str(folder))


def test_they_are_strictly_typed(scaffolds, tmp_path):
    require("mypy")
    sources = [str(scaffolds.source(kind) / own.package) for kind, own in scaffolds.names.items()]
    tests = [str(file) for kind in PLANS for file in (scaffolds.folder / kind / "tests").glob("*.py")]
    config = tmp_path / "mypy.ini"
    config.write_text("[mypy]\n[mypy-numba.*,torch.*,onnxruntime.*]\nignore_missing_imports = True\n", encoding="utf-8")
    flags = ["--strict", "--follow-imports=silent", "--explicit-package-bases", "--config-file", str(config)]
    path = os.pathsep.join([*(str(scaffolds.source(kind)) for kind in PLANS), *SOURCES])
    run("mypy", *flags, "--cache-dir", str(tmp_path / "cache"), *sources, *tests, env={"MYPYPATH": path})


@pytest.mark.slow
def test_they_pass_pyright(scaffolds):
    require("pyright")
    sources = [str(scaffolds.source(kind)) for kind in PLANS]
    run("pyright", "--pythonpath", sys.executable, *sources, path=scaffolds.path)


def test_the_gripper_is_built_installed_found_run_and_removed(scaffolds, tmp_path):
    require("build")
    require("pip")
    wheels, site = tmp_path / "wheels", tmp_path / "site"
    project = str(scaffolds.folder / "gripper")
    run("build", "--wheel", "--no-isolation", "--outdir", str(wheels), project)
    (wheel,) = wheels.glob("*.whl")
    quiet = ("--no-deps", "--no-index", "--disable-pip-version-check", "--quiet")
    run("pip", "install", *quiet, "--target", str(site), str(wheel))
    path = os.pathsep.join([str(site), *SOURCES])
    assert "mock-acme-gripper" in run("lsds.cli.main", "plugins", "--kind", "gripper", path=path, cwd=tmp_path)
    sets = [part for key in ("gripper.backend=mock-acme-gripper", "task.lift_s=0.5") for part in ("--set", key)]
    assert "held (simulated)" in run("lsds.cli.main", "run", "--no-plot", *sets, path=path, cwd=tmp_path)
    (installed,) = distributions(name="lsds-acme-gripper", path=[str(site)])
    # pip does not uninstall from a target folder; this is what it removes from others.
    for file in [Path(str(installed.locate_file(file))) for file in installed.files or ()]:
        file.unlink()
    assert [file for file in site.rglob("*") if file.is_file() and file.suffix != ".pyc"] == []
    listed = run("lsds.cli.main", "plugins", "--kind", "gripper", path=path, cwd=tmp_path)
    assert "mock-acme-gripper" not in listed
