"""Project rules that the linter does not have, checked on the syntax trees."""

from __future__ import annotations

import ast
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("lsds", "plugins/lsds_plugins", "plugins/lsds_research", "drivers/lsds_drivers", "mocks/lsds_mocks")
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
MAY_READ_THE_WALL_CLOCK = ("lsds/clock.py", "drivers/lsds_drivers/")
WALL_CLOCK_CALLS = {"now", "utcnow", "today"}


def name(path):
    return path.relative_to(ROOT).as_posix()


@pytest.fixture(scope="module")
def trees():
    """Every source file's syntax tree, by its name."""
    return {name(path): ast.parse(path.read_text(encoding="utf-8"), str(path)) for path in SOURCES}


def imported(module):
    """Names of all modules that a file imports, or imports from."""
    for node in ast.walk(module):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ""


def wall_clock_uses(module):
    for node in ast.walk(module):
        if isinstance(node, ast.Import):
            yield from (f"line {node.lineno}: import {a.name}" for a in node.names if a.name.split(".")[0] == "time")
        elif isinstance(node, ast.ImportFrom) and node.module == "time":
            yield f"line {node.lineno}: from time import"
        elif (
            isinstance(node, ast.Attribute)
            and node.attr in WALL_CLOCK_CALLS
            and isinstance(node.value, ast.Name | ast.Attribute)
            and (node.value.id if isinstance(node.value, ast.Name) else node.value.attr) in ("datetime", "date")
        ):
            yield f"line {node.lineno}: {ast.unparse(node)}"


def test_there_are_sources_to_look_at():
    assert len(SOURCES) > 30


def test_only_the_clock_and_the_drivers_read_the_wall_clock(trees):
    others = {file: module for file, module in trees.items() if not file.startswith(MAY_READ_THE_WALL_CLOCK)}
    assert [f"{file}, {use}" for file, module in others.items() for use in wall_clock_uses(module)] == []


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("import time", 1),
        ("from time import sleep", 1),
        ("import datetime\ndatetime.datetime.now()", 1),
        ("from datetime import date\ndate.today()", 1),
        ("clock.now()", 0),
        ("import timeit", 0),
    ],
)
def test_the_rule_about_the_wall_clock_finds_what_it_should(text, found):
    assert len(list(wall_clock_uses(ast.parse(text)))) == found


def test_one_place_starts_python(trees):
    """It keeps the current folder out of the module search path, which `python -m` and `python -c` begin with."""
    others = {file: module for file, module in trees.items() if file != "lsds/support/processes.py"}
    found = [
        f"{file}, line {node.lineno}"
        for file, module in others.items()
        for node in ast.walk(module)
        if isinstance(node, ast.Attribute) and ast.unparse(node) == "sys.executable"
    ]
    assert found == []


def test_every_module_says_what_it_is_for(trees):
    assert [file for file, module in trees.items() if not ast.get_docstring(module)] == []


def test_no_pickle_is_ever_loaded(trees):
    loaders = {"pickle", "joblib", "dill", "cloudpickle", "shelve", "marshal"}
    own = {
        # Code that the mock arm's own child compiled for it, by a pipe that nobody else has.
        "mocks/lsds_mocks/wire/ur/script/compilation.py": {"marshal"},
        "mocks/lsds_mocks/wire/ur/script/compile_server.py": {"marshal"},
    }
    found = {file: loaders & set(imported(module)) for file, module in trees.items()}
    assert {file: names for file, names in found.items() if names} == own


def test_nothing_but_the_kit_imports_a_test_library(trees):
    others = {file: module for file, module in trees.items() if not file.startswith("lsds/testing/")}
    # These run the kit, and import it when they are called.
    for command in ("lsds/cli/check.py", "lsds/cli/check_client.py"):
        others.pop(command)
    for_tests = ("pytest", "hypothesis", "lsds.testing")
    assert [
        f"{file} imports {used}"
        for file, module in others.items()
        for used in imported(module)
        if used.startswith(for_tests)
    ] == []


def test_every_package_has_an_init():
    folders = {path.parent for path in SOURCES}
    assert [name(folder) for folder in sorted(folders) if not (folder / "__init__.py").exists()] == []


def test_no_tracked_file_holds_an_absolute_path_of_somebodys_machine():
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    # Written in pieces, so that this file does not hold what it looks for.
    wanted = ["/" + "work/", "/" + "home/", "/" + "Users/"]
    found = []
    for line in filter(None, listed.stdout.split("\0")):
        path = ROOT / line
        if path.suffix in (".py", ".md", ".toml", ".txt", ".json", ".yml", ".yaml", "") and path.is_file():
            text = path.read_text(encoding="utf-8", errors="replace")
            found += [f"{line}: {word}" for word in wanted if word in text]
    assert found == []
