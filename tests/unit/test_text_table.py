"""Tables fit the terminal and lose nothing."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.cli.main import main
from lsds.cli.text_table import table

words = st.text(st.characters(codec="ascii", categories=["L", "N"]), min_size=1, max_size=9)
cells = st.lists(words, min_size=0, max_size=6).map(" ".join)


@st.composite
def tables(draw):
    columns = draw(st.integers(1, 5))
    header = tuple(draw(words) for _ in range(columns))
    return draw(st.lists(st.tuples(*[cells] * columns), min_size=1, max_size=4)), header


@given(tables(), st.integers(20, 120))
def test_every_word_is_there_and_no_line_is_too_long(drawn, width):
    rows, header = drawn
    text = table(rows, header, width)
    assert all(len(line) <= width for line in text.splitlines())
    squeezed = "".join(text.split())
    for row in rows:
        for cell in row:
            assert all(word in squeezed for word in cell.split())


def test_without_a_limit_a_row_is_a_line():
    rows = [("a", "x " * 100), ("b", "y")]
    assert table(rows, ("name", "text"), 10**6).splitlines()[2] == f"a     {'x ' * 100}".rstrip()


def test_a_cell_is_wrapped_in_its_column():
    text = table([("one", "several words that need room"), ("two", "short")], ("key", "text"), 25)
    assert text.splitlines() == [
        "key  text",
        "---  --------------------",
        "one  several words that",
        "     need room",
        "two  short",
    ]


def test_what_cannot_fit_is_written_row_by_row():
    rows = [("12345678", "87654321", "11111111")]
    assert table(rows, ("first", "second", "third"), 20) == "first: 12345678\nsecond: 87654321\nthird: 11111111"


@pytest.mark.parametrize("columns", [40, 80])
def test_the_list_of_plugins_fits(monkeypatch, capsys, columns):
    monkeypatch.setenv("COLUMNS", str(columns))
    assert main(["plugins"]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= columns
    titles = [
        line.split(":")[0] for line in out.splitlines() if line.startswith(("Devices", "Algor", "Commands", "Test"))
    ]
    assert titles == ["Devices", "Algorithms", "Commands", "Test equipment"]
    assert "camera-noise" not in out


def test_faults_are_listed_if_asked_for(capsys):
    assert main(["plugins", "--all"]) == 0
    assert "camera-noise" in capsys.readouterr().out
    assert main(["plugins", "--kind", "fault"]) == 0
    assert "camera-noise" in capsys.readouterr().out
