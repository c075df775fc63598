"""`lsds.testing` as a library: results as data, and what it imports."""

from __future__ import annotations

import ast
import sys
from pathlib import Path

import pytest
from fake_cell import FakeSensor, fake_host

import lsds.testing
from lsds.errors import MissingExtra
from lsds.testing import Bench, CheckResult, run_checks
from lsds.testing.tables import CHECKED_KINDS, GUIDE, checks_of, guide_of, rule_of

ROOT = Path(__file__).parents[2]
KIT = sorted((ROOT / "lsds" / "testing").glob("*.py"))
BASE = {"click", "cv2", "numpy", "onnxruntime", "pluggy", "pydantic", "lsds"}
EXTRA = {"pytest", "hypothesis"}


def imported(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield (node.module or "").partition(".")[0]


def test_the_kit_needs_the_base_install_and_the_extra_testing_only():
    found = {name for path in KIT for name in imported(path)} - set(sys.stdlib_module_names)
    assert found <= BASE | EXTRA
    assert found >= EXTRA


def test_the_extra_holds_just_what_the_kit_needs():
    import re
    import tomllib

    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    assert {re.split(r"\W", text)[0] for text in extras["testing"]} == EXTRA
    assert "pip install 'lsds-tactile[testing]'" in lsds.testing.__doc__


def test_the_public_names_exist():
    assert all(getattr(lsds.testing, name) for name in lsds.testing.__all__)
    with pytest.raises(AttributeError, match="it has Bench, Case"):
        lsds.testing.check  # noqa: B018


def test_a_missing_library_is_named_with_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "hypothesis", None)
    monkeypatch.delitem(vars(lsds.testing), "conformance", raising=False)
    with pytest.raises(MissingExtra, match=r"lsds.testing needs hypothesis.*pip install 'lsds-tactile\[testing\]'"):
        lsds.testing.conformance  # noqa: B018


def test_results_are_data(monkeypatch):
    bench = Bench("sensor", "fake-sensor", host=fake_host())
    (passed,) = run_checks(bench, ["spec_is_sound"])
    assert passed == CheckResult("spec_is_sound", "passed", rule=passed.rule)
    monkeypatch.setattr(FakeSensor, "read", lambda self: 1 / 0)
    seen = []
    results = run_checks(bench, ["frame_rate", "spec_is_sound"], lambda *given: seen.append(given))
    by_name = {result.name: result for result in results}
    assert by_name["frame_rate"].outcome == "failed"
    assert by_name["frame_rate"].message.startswith("ZeroDivisionError: division by zero\nrule: New frames arrive")
    assert isinstance(by_name["frame_rate"].error, ZeroDivisionError)
    assert [(result.name, number, count) for result, number, count in seen] == [
        (result.name, number, 2) for number, result in enumerate(results, 1)
    ]


def test_a_skipped_check_names_its_need():
    bench = Bench("gripper", "real-gripper", host=fake_host())
    moving, unplugged = run_checks(bench, ["gripper_stops", "unplugged_device_is_reported"])[::-1]
    assert (moving.outcome, moving.needs) == ("skipped", "motion")
    assert (unplugged.outcome, unplugged.needs) == ("skipped", "unplug")


def test_an_unknown_check_is_refused():
    with pytest.raises(ValueError, match="no check for the kind gripper is named flies; its checks: "):
        run_checks(Bench("gripper", "fake-gripper", host=fake_host()), ["flies"])


def test_every_check_has_a_rule_and_a_section_of_the_guide_that_exists():
    text = (ROOT / GUIDE).read_text(encoding="utf-8")
    headings = [line.lstrip("# ").lower().replace(" ", "-") for line in text.splitlines() if line.startswith("#")]
    for kind in CHECKED_KINDS:
        for check in checks_of(kind):
            assert rule_of(check), check
            assert guide_of(kind, check).partition("#")[2] in headings, (kind, check)
