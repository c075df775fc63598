"""Files name the distribution that pip installs: on the package index, `lsds` alone is another project."""

from __future__ import annotations

import re
import subprocess
import tomllib
from pathlib import Path

import pytest

from lsds.registry.backends import OWN_DISTRIBUTION

ROOT = Path(__file__).resolve().parents[2]
OTHER_PROJECT = re.compile(
    r"""
    # An extra of it.
    (?<![\w.-])lsds\\?\[[a-z{]
    # A command that installs it.
    | \b(?:pip|uv|pipx)\ [^\n;&|`\\]*?\binstall\b
      (?:[ ]+(?:"[^"\n]*"|'[^'\n]*'|[^\s;&|`\\"']+))*?[ ]+['"]?lsds(?![\w\\-])
    # A requirement.
    | \bdependencies\ =\ \[[^\]]*["']lsds\s*["'=<>~!;]
    """,
    re.VERBOSE,
)


def tracked():
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    return [ROOT / name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()]


def test_no_file_installs_the_other_project():
    found = []
    for path in tracked():
        text = path.read_bytes().decode("utf-8", errors="ignore") if path.suffix not in (".png", ".onnx") else ""
        for hit in OTHER_PROJECT.finditer(text):
            line = text.count("\n", 0, hit.end()) + 1
            found.append(f"{path.relative_to(ROOT).as_posix()}:{line}: {hit.group()!r}; write {OWN_DISTRIBUTION}")
    assert found == []


# Written in pieces, so that this file does not hold what it looks for.
NAME = "ls" + "ds"


@pytest.mark.parametrize(
    "text",
    [
        f"pip install {NAME}",
        f"pip install -U {NAME}; then",
        f"pip -q install '{NAME}>=0.1'",
        f"pip install numpy 'scipy>=1' {NAME}",
        f"uv pip install {NAME}",
        f"needs '{NAME}[sim]'",
        f"match='{NAME}\\[sim'",
        f"'{NAME}[{{extra}}]'",
        f'dependencies = ["numpy", "{NAME}"]',
        f'dependencies = [\n    "{NAME}>=0.1",\n]',
    ],
)
def test_what_names_the_other_project(text):
    assert OTHER_PROJECT.search(text)


@pytest.mark.parametrize(
    "text",
    [
        f"pip uninstall {NAME}",
        f"pip uninstall {NAME}; pip install {NAME}-tactile",
        f"pip install '{NAME}-tactile[sim]'",
        f"pip install -q '.[sim]' && {NAME} run",
        f"pip install {NAME}-acme",
        f'dependencies = ["{NAME}-tactile>=0.1"]',
        f"acme_{NAME}[0]",
    ],
)
def test_what_does_not(text):
    assert not OTHER_PROJECT.search(text)


def test_the_registry_knows_the_name_in_pyproject():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["name"] == OWN_DISTRIBUTION
