"""`lsds study grip`: runs that go on, figures that come from the truth, a picture."""

from __future__ import annotations

import json
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_research.studies.grip import study
from lsds_research.studies.grip.lift import CLOSES_M, Lift, reversals
from lsds_research.studies.grip.options import GripOptions
from lsds_research.studies.grip.random_objects import drawn
from lsds_research.studies.grip.study import GripStudy

from lsds.cli.main import main
from lsds.clock import VirtualClock
from lsds.config import load_config
from lsds.contracts import BuildContext

pytestmark = pytest.mark.usefixtures("installed_host")
ONE = ["study", "grip", "--object", "pvc-pipe", "--squeeze-mm", "1.0", "--speed", "0.08", "--jobs", "1"]


@pytest.fixture
def evaluated(capsys):
    """Runs the command; returns its exit code and all that it prints."""

    def call(*arguments):
        code = main([*ONE, *arguments])
        printed = capsys.readouterr()
        return code, printed.out + printed.err

    return call


def test_belief_holds_with_less_than_pd_and_a_fixed_grip_drops(evaluated, tmp_path):
    kept, result, picture = tmp_path / "runs.jsonl", tmp_path / "grip.json", tmp_path / "grip.png"
    code, output = evaluated("--out", str(kept), "--json", str(result), "--plot", str(picture))
    assert code == 0, output
    runs = {run["controller"]: run for run in json.loads(result.read_text())["runs"]}
    assert set(runs) == {"belief", "pd", "off"}
    assert runs["belief"]["held"]
    assert not runs["off"]["held"]
    assert 1 < runs["belief"]["steady_over_needed"] < min(2.0, runs["pd"]["steady_over_needed"] or 99)
    assert runs["off"]["closings"] == 0
    assert runs["off"]["first_over_needed"] < 1 < runs["belief"]["peak_over_needed"]
    assert picture.stat().st_size > 5000
    # Stored runs are not repeated; an incomplete line is run again.
    lines = kept.read_text().splitlines()
    assert len(lines) == 3
    known = [json.loads(line) for line in lines[:2]]
    known[0]["run"]["slip_mm"] = 123.0
    kept.write_text("\n".join(json.dumps(line) for line in known) + "\n" + lines[2][:40])
    code, output = evaluated("--out", str(kept), "--json", str(result))
    assert code == 0, output
    again = json.loads(result.read_text())["runs"]
    assert max(run["slip_mm"] for run in again) == 123.0
    assert len(again) == 3


def test_an_unknown_object_is_one_line(evaluated):
    code, output = evaluated("--object", "unicorn", "--object", "bal")
    assert code == 2
    assert "unicorn" in output
    assert "pvc-pipe" in output
    assert "did you mean 'ball'?" in output


def test_a_file_that_is_no_list_of_runs_is_not_touched(evaluated, tmp_path):
    other = tmp_path / "notes.txt"
    other.write_text("hello\nworld\n")
    code, output = evaluated("--out", str(other))
    assert code != 0
    assert "line 1" in output
    assert other.read_text() == "hello\nworld\n"


def test_random_objects_are_the_same_for_a_draw_and_others_for_another():
    assert drawn(5, 3) == drawn(5, 3)
    assert drawn(5, 3) != drawn(6, 3)
    assert drawn(5, 3) != drawn(5, 4)


@pytest.mark.parametrize("index", range(60))
def test_every_random_object_is_one_that_the_cell_takes(index):
    config = load_config(None, drawn(7, index).overrides())
    assert config.cell.backend == "simulated"


def test_only_random_objects_that_a_firm_grip_holds_count(tmp_path):
    options = GripOptions(random=2, draw=0, controllers=["belief"], jobs=1, out=str(tmp_path / "runs.jsonl"))
    result = GripStudy(options, BuildContext(VirtualClock(), 0)).run(lambda done, whole: None)
    (row,) = result.rows
    assert row["controller"] == "belief"
    runs = result.details["runs"]
    assert 0 < row["runs"] == len(runs) <= 2
    assert "draw 0 for development" in result.title


def test_a_firm_grip_that_holds_is_the_last_one_that_is_tried(monkeypatch, tmp_path):
    lifted: list[Lift] = []

    def instant(what):
        lifted.append(what)
        number = int(what.object.rpartition("-")[2])
        held = number < 2 and what.squeeze_mm >= (3.0, 6.0)[number]
        return {"controller": what.controller, "object": what.object, "held": held}

    monkeypatch.setattr(study, "lift", instant)
    options = GripOptions(random=3, draw=0, controllers=["belief"], jobs=1, out=str(tmp_path / "runs.jsonl"))
    ticks: list[tuple[int, int]] = []
    found, failures = study._of_random_objects(options, [], lambda done, total: ticks.append((done, total)))
    firm = [(what.object[-1], what.squeeze_mm) for what in lifted if what.controller == "off"]
    assert firm == [("0", 3.0), ("1", 3.0), ("2", 3.0), ("1", 6.0), ("2", 6.0), ("2", 10.0)]
    assert [what.object[-1] for what in lifted if what.controller == "belief"] == ["0", "1"]
    assert len(found) == len(lifted)
    assert not failures
    assert ticks[-1] == (8, 8)


TICKS = st.lists(st.integers(-20, 20), max_size=40)


@given(TICKS)
def test_reversals_are_the_local_extremes_of_the_aperture(ticks):
    """With steps of whole closings, nothing is below the least step, and each turning point counts once."""
    moves = [after - before for before, after in pairwise(ticks) if after != before]
    turns = sum(after * before < 0 for before, after in pairwise(moves))
    assert len(reversals([(number, tick * 1.01 * CLOSES_M) for number, tick in enumerate(ticks)])) == turns


@given(TICKS)
def test_an_aperture_that_moves_by_less_than_a_closing_does_not_reverse(ticks):
    assert reversals([(number, tick * CLOSES_M / 41) for number, tick in enumerate(ticks)]) == []
