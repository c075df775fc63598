"""The wheel holds the packages of lsds, the light manifests, and nothing else."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = {"lsds", "lsds_plugins", "lsds_research", "lsds_drivers", "lsds_mocks"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    for tool in ("build", "hatchling"):
        if importlib.util.find_spec(tool) is None:
            pytest.skip(f"{tool} is not installed (pip install 'lsds-tactile[dev]' hatchling)")
    if not (ROOT / "README.md").exists():
        pytest.skip("there is no README.md yet, and the build needs it")
    out = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(out), str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    (path,) = out.glob("*.whl")
    with zipfile.ZipFile(path) as archive:
        yield archive


def test_it_holds_only_our_packages(wheel):
    tops = {name.split("/")[0] for name in wheel.namelist()}
    assert {top for top in tops if not top.endswith(".dist-info")} == PACKAGES


def test_each_package_is_typed(wheel):
    assert {f"{package}/py.typed" for package in PACKAGES} <= set(wheel.namelist())


def test_no_tests_and_no_caches_are_shipped(wheel):
    assert not [name for name in wheel.namelist() if "__pycache__" in name or name.startswith("tests/")]


def test_every_module_is_shipped(wheel):
    shipped = set(wheel.namelist())
    for folder in ("lsds", "plugins/lsds_plugins", "plugins/lsds_research", "drivers/lsds_drivers", "mocks/lsds_mocks"):
        parent = (ROOT / folder).parent
        modules = {path.relative_to(parent).as_posix() for path in (ROOT / folder).rglob("*.py")}
        assert modules <= shipped


def test_the_entry_points_name_what_is_there(wheel):
    (entry_points,) = [name for name in wheel.namelist() if name.endswith("entry_points.txt")]
    text = wheel.read(entry_points).decode()
    assert "lsds = lsds.cli.main:program" in text
    for package in ("lsds_plugins", "lsds_research", "lsds_drivers", "lsds_mocks"):
        assert f"{package}.manifest" in text
