"""The tiers of the tests: marks by measured durations, and a file that names only tests that exist."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests import tiers

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    ("node", "marks", "expected"),
    [
        ("tests/unit/test_a.py::test_new", set(), {"quick"}),
        ("tests/closed_loop/test_a.py::test_new", set(), set()),
        ("tests/unit/test_a.py::test_half", set(), set()),
        ("tests/unit/test_a.py::test_long", set(), {"slow"}),
        ("tests/unit/test_a.py::test_long", {"usual"}, set()),
        ("tests/unit/test_a.py::test_new", {"slow"}, set()),
    ],
)
def test_a_test_is_quick_usual_or_slow_by_its_duration(node, marks, expected):
    durations = {"tests/unit/test_a.py::test_half": 0.4, "tests/unit/test_a.py::test_long": 20.0}
    assert tiers.tiers(node, marks, durations) == expected


def test_stored_durations_are_read_back(tmp_path, monkeypatch):
    monkeypatch.setattr(tiers, "FILE", tmp_path / "durations.json")
    tiers.store({"a.py::test_x[1-y::z]": 2.04, "a.py::test_y": 0.1, "b.py::test_z": 0.3}, tiers.FILE)
    assert tiers.stored() == {"a.py::test_x[1-y::z]": 2.0, "b.py::test_z": 0.3}
    tiers.store({"b.py::test_z": 0.1, "b.py::test_new": 1.0}, tiers.FILE)
    assert tiers.stored() == {"a.py::test_x[1-y::z]": 2.0, "b.py::test_new": 1.0}


def test_the_file_of_durations_names_only_files_that_exist():
    by_file = json.loads(tiers.FILE.read_text(encoding="utf-8"))
    assert [file for file in by_file if not (ROOT / file).exists()] == []
