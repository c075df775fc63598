"""The documents quote what a command has printed: rows of tables are compared with stored output and its commit."""

from __future__ import annotations

import re
import runpy
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
measure = runpy.run_path(str(DOCS / "measure.py"))
MEASUREMENTS, stored = measure["MEASUREMENTS"], measure["stored"]


def rows_with_figures(page):
    """Rows of tables that hold a number outside of code."""
    lines = (DOCS / page).read_text(encoding="utf-8").splitlines()
    return [
        line
        for before, line in zip(["", *lines], lines, strict=False)
        if line.startswith("| ") and re.search(r"\d", re.sub(r"`[^`]*`", "", line)) and before.startswith("|")
    ]


@pytest.mark.parametrize("name", MEASUREMENTS)
def test_a_page_quotes_the_stored_output(name):
    measurement, record = MEASUREMENTS[name], stored(name)
    assert record["command"] == measurement.command
    assert record["date"]
    text = (DOCS / measurement.page).read_text(encoding="utf-8").splitlines()
    assert [row for row in measurement.rows(record["values"]) if row not in text] == []


@pytest.mark.parametrize("name", MEASUREMENTS)
def test_the_output_is_of_a_commit_of_this_history(name):
    commit = stored(name)["commit"].split()[0]
    if not (ROOT / ".git").exists():
        pytest.skip("not a checkout")
    done = subprocess.run(["git", "cat-file", "-t", commit], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"{commit} is not in this copy of the history")
    assert done.stdout.strip() == "commit"


@pytest.mark.parametrize("page", ["figures.md", "learning.md"])
def test_no_figure_comes_without_its_output(page):
    known = {
        row
        for own in MEASUREMENTS
        if MEASUREMENTS[own].page == page
        for row in MEASUREMENTS[own].rows(stored(own)["values"])
    }
    assert [row for row in rows_with_figures(page) if row not in known] == []
