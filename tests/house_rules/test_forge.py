"""What runs on the forge and before a commit is what contributors are told to run."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

yaml = pytest.importorskip("yaml", reason="PyYAML is not installed; it comes with the extra 'test'")

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


@pytest.fixture(scope="module")
def jobs():
    return yaml.safe_load((ROOT / ".github/workflows/ci.yml").read_text(encoding="utf-8"))["jobs"]


@pytest.fixture(scope="module")
def hooks():
    (repository,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"]
    assert repository["repo"] == "local", "versions are those of constraints.txt"
    return {hook["id"]: hook for hook in repository["hooks"]}


def test_every_job_runs_the_tests_of_the_readme(jobs):
    for name, job in jobs.items():
        assert [step["run"] for step in job["steps"] if "run" in step] == [".ci/run"], name
    assert os.access(ROOT / ".ci/run", os.X_OK)


def test_every_python_that_is_promised_is_tested_and_macos_once(jobs):
    matrix = jobs["tests"]["strategy"]["matrix"]
    found = [re.fullmatch(r"Programming Language :: Python :: (3\.\d+)", line) for line in PROJECT["classifiers"]]
    promised = [match[1] for match in found if match]
    assert matrix["os"] == ["ubuntu-latest"]
    assert matrix["python"] == promised
    assert f">={promised[0]}" == PROJECT["requires-python"]
    assert [job["os"] for job in matrix["include"]] == ["macos-latest"]


def test_the_site_is_built_strictly_with_its_extra_and_stored():
    text = (ROOT / ".github/workflows/site.yml").read_text(encoding="utf-8")
    ((_, job),) = yaml.safe_load(text)["jobs"].items()
    assert [step["run"] for step in job["steps"] if "run" in step] == [
        "pip install -c constraints.txt '.[docs]'",
        "mkdocs build --strict",
    ]
    assert "docs" in PROJECT["optional-dependencies"]
    built = re.search(r"^site_dir: (.+)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"), re.MULTILINE)
    assert job["steps"][-1]["with"]["path"] == built[1]


def test_every_hook_runs_a_tool_that_the_extra_dev_installs(hooks):
    tools = {re.split(r"[\[<>=;]", requirement)[0] for requirement in PROJECT["optional-dependencies"]["dev"]}
    places = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    assert set(hooks) == {"ruff", "ruff-format", "mypy", "lint-imports"}
    for hook in hooks.values():
        tool = hook["entry"].split()[0]
        assert hook["language"] == "system"
        assert {"lint-imports": "import-linter"}.get(tool, tool) in tools
        if shutil.which(tool, path=places) is None:
            pytest.skip(f"{tool} is not installed (pip install 'lsds-tactile[dev]')")
        done = subprocess.run([shutil.which(tool, path=places), "--help"], capture_output=True, check=False)
        assert done.returncode == 0, done.stderr
