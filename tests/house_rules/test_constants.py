"""A named number has one value, one statement and one sentence."""

from __future__ import annotations

import shutil

import pytest

from tests.house_rules import constants

needs_git = pytest.mark.skipif(
    shutil.which("git") is None or not (constants.ROOT / ".git").exists(), reason="needs the files that git tracks"
)


@needs_git
@pytest.mark.parametrize("rule", constants.RULES)
def test_no_constant_breaks_a_rule(rule):
    broken = constants.offences(constants.tree())[rule]
    assert [f"{c.file}:{c.line}: {c.name} = {c.value}" for c in broken] == [], constants.RULES[rule]


def _broken(*sources):
    found = [c for k, source in enumerate(sources) for c in constants.constants(source, f"{k}.py")]
    return {rule: [c.name for c in broken] for rule, broken in constants.offences(found).items()}


def test_a_name_with_two_values_is_found_whether_private_or_not():
    assert _broken("A_S = 1  # s", "_A_S = 2  # s", "B = 3  # m")["collisions"] == ["A_S", "_A_S"]
    assert _broken("A_S = 1  # s", "_A_S = 1.0  # s")["collisions"] == []


def test_numbers_that_share_a_statement_are_found():
    assert _broken("# both\nA, B = 1, -2.5")["several at once"] == ["A", "B"]
    assert _broken("# both\nA = B = 1")["several at once"] == ["A", "B"]
    assert _broken("# a range\nA = 1, 2")["several at once"] == []


@pytest.mark.parametrize(
    ("source", "unexplained"),
    [
        ('A = 1\n"""Seconds."""', []),
        ("# Seconds.\nA = 1", []),
        ("A = 1  # seconds", []),
        ("A = (\n    1,\n    2,\n)  # seconds", []),
        ("A = 1", ["A"]),
        ('A = 1\nB = 2\n"""Seconds, of the one above it."""', ["A"]),
        ("A = 1  # type: ignore[misc]", ["A"]),
    ],
)
def test_a_constant_without_a_sentence_is_found(source, unexplained):
    assert _broken(source)["no sentence"] == unexplained


@pytest.mark.parametrize(
    ("value", "number"),
    [
        ("-2", -2.0),
        ("math.radians(180) / math.pi", 1.0),
        ("(1, (2, 3))", (1.0, (2.0, 3.0))),
        ("2 * BASE", 20.0),
        ("int('3')", None),
        ("'text'", None),
        ("True", None),
        ("()", None),
    ],
)
def test_numbers_are_read_from_expressions(value, number):
    read = {c.name: c.value for c in constants.constants(f"BASE = 10\nREAD: Final = {value}\nlower = 1")}
    assert read.get("READ") == number
    assert "lower" not in read
