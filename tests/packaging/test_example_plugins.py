"""The example distributions: installed next to lsds, they are found, and their own tests pass."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from scaffolds import ROOT, SOURCES

EXAMPLES = ROOT / "examples" / "plugins"
TESTS = sorted(test.relative_to(EXAMPLES).as_posix() for test in EXAMPLES.glob("*/tests/test_*.py"))
NEEDS = {
    "digit": ("cv2", "numba"),
    "franka-hand": (),
    "lerobot_camera_lsds": ("numba",),
    "lerobot_robot_lsds": ("numba",),
    "lsds_ros2": ("numba",),
    "onrobot-rg2": ("pymodbus", "numba"),
}
"""Modules that the tests of an example need, by its folder."""
KINDS = {"digit": ("sensor",), "franka-hand": ("gripper",), "onrobot-rg2": ("gripper", "wire_mock")}
"""Kinds of the backends that have the name of the example."""
PUBLIC = ("lsds.clock", "lsds.contracts", "lsds.errors", "lsds.registry")


def package(name):
    """Return the import package of an example."""
    (folder,) = (EXAMPLES / name / "src").iterdir()
    return folder.name


def run(*command, path, cwd, **variables):
    done = subprocess.run(
        [sys.executable, "-m", *command],
        capture_output=True,
        text=True,
        check=False,
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": path, **variables},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A function that installs an example into a new folder; it returns its sources and the search path."""
    for tool in ("pip", "hatchling"):
        if importlib.util.find_spec(tool) is None:
            pytest.skip(f"{tool} is not installed; hatchling comes with the extra 'dev'")
    done = {}

    def install(name):
        if name not in done:
            missing = [module for module in NEEDS[name] if importlib.util.find_spec(module) is None]
            if missing:
                pytest.skip(f"{name} needs {', '.join(missing)}")
            folder = tmp_path_factory.mktemp(name)
            # The build must leave nothing in the tree.
            sources = shutil.copytree(EXAMPLES / name, folder / "sources")
            site = folder / "site"
            quiet = ("--no-deps", "--no-build-isolation", "--no-index", "--disable-pip-version-check", "--quiet")
            run("pip", "install", *quiet, "--target", str(site), str(sources), path="", cwd=folder)
            done[name] = sources, os.pathsep.join([str(site), *SOURCES])
        return done[name]

    return install


def test_there_are_examples():
    assert "onrobot-rg2/tests/test_lift.py" in TESTS
    assert {Path(test).parts[0] for test in TESTS} == {folder.name for folder in EXAMPLES.iterdir()} == set(NEEDS)


@pytest.mark.parametrize("test", TESTS)
def test_its_own_tests_pass(installed, test, tmp_path):
    name, _, file = test.partition("/")
    sources, path = installed(name)
    out = run("pytest", "-q", "-p", "no:cacheprovider", str(sources / file), path=path, cwd=tmp_path)
    assert "passed" in out
    assert "failed" not in out


@pytest.mark.parametrize("name", KINDS)
def test_lsds_lists_the_example(installed, name, tmp_path):
    _, path = installed(name)
    for kind in KINDS[name]:
        assert name in run("lsds.cli.main", "plugins", "--kind", kind, path=path, cwd=tmp_path)


@pytest.mark.parametrize("name", NEEDS)
def test_the_example_imports_only_the_public_contract(name):
    found = set()
    for source in (EXAMPLES / name / "src").rglob("*.py"):
        for line in source.read_text(encoding="utf-8").splitlines():
            if line.lstrip().startswith(("from lsds", "import lsds")):
                found.add(line.split()[1])
    public = (*PUBLIC, f"{package(name)}.")
    assert len(found) > 2
    assert [module for module in found if module not in ("lsds", package(name)) and not module.startswith(public)] == []


@pytest.mark.parametrize("name", NEEDS)
@pytest.mark.parametrize("tool", ["ruff", "mypy"])
def test_the_example_is_clean(installed, name, tool, tmp_path):
    if importlib.util.find_spec(tool) is None:
        pytest.skip(f"{tool} is not installed; it comes with the extra 'dev'")
    sources, path = installed(name)
    if tool == "ruff":
        run("ruff", "check", "--no-cache", ".", path=path, cwd=sources)
        run("ruff", "format", "--no-cache", "--check", ".", path=path, cwd=sources)
    else:
        flags = ("--strict", "--follow-imports=silent", "--ignore-missing-imports", "--cache-dir", str(tmp_path))
        own = [str(sources / folder) for folder in ("src", "tests", "tests/standin") if (sources / folder).is_dir()]
        files = ("--explicit-package-bases", "--config-file", os.devnull, f"src/{package(name)}", "tests")
        run("mypy", *flags, *files, path=path, cwd=sources, MYPYPATH=os.pathsep.join([*own, *SOURCES]))
