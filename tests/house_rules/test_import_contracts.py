"""Imports point one way; the contracts are in pyproject.toml."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("lsds", "plugins/lsds_plugins", "plugins/lsds_research", "drivers/lsds_drivers", "mocks/lsds_mocks")


def test_import_contracts_are_kept():
    tool = shutil.which("lint-imports", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))
    if tool is None:
        pytest.skip("import-linter is not installed (pip install 'lsds-tactile[dev]')")
    empty = [package for package in PACKAGES if not (ROOT / package / "__init__.py").exists()]
    if empty:
        pytest.skip(f"no code yet in {', '.join(empty)}")
    folders = [str(ROOT / folder) for folder in (".", "plugins", "drivers", "mocks")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(folders)}
    done = subprocess.run([tool, "--no-cache"], cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
