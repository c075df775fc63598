"""`lsds study loop` and `lsds study choose`: whole configurations, their front, and the cheapest that will do."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_research.studies.loop.lifts import Configuration, mark_front, summarized
from lsds_research.studies.loop.study import default_configuration, default_note

from lsds.cli.main import main
from lsds.config import load_config

pytestmark = pytest.mark.usefixtures("installed_host")
FEW = ["--tracker", "lk", "--pair", "threshold+field", "--object", "pvc-pipe", "--squeeze-mm", "1.0", "--jobs", "1"]


@pytest.fixture
def run(capsys):
    """Runs a command; returns its exit code, what it prints, and its errors."""

    def call(*arguments):
        try:
            code = main([*arguments])
        except SystemExit as ended:
            code = ended.code
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return call


def lifts(*cases):
    names = ("held", "frame_mean_us", "cost", "slip_mm", "steady_over_needed")
    return [dict(zip(names, case, strict=True)) for case in cases]


def test_a_row_is_of_the_lifts_that_slipped():
    rows = lifts((True, 900.0, 0.1, 0.0, 5.0), (True, 1100.0, 0.1, 2.0, 1.4), (True, 1000.0, 0.1, 4.0, 1.6))
    row = summarized(Configuration("lk", "a", "b", "belief"), rows)
    assert (row["frame_us"], row["slip_mm"], row["steady"], row["steady_all"]) == (1000.0, 3.0, 1.5, 1.6)
    assert row["configuration"] == "lk a+b belief"
    assert summarized(Configuration("lk", "a", "b", "belief", 1.2), rows)["configuration"] == "lk a+b belief 1.2 ms"


@given(st.lists(st.tuples(st.booleans(), *[st.integers(1, 4)] * 3), min_size=1, max_size=12))
def test_what_is_on_the_front_is_beaten_by_none_and_everything_else_is(points):
    rows = [
        {"held": float(held), "frame_us": time, "slip_mm": slip, "steady": grip} for held, time, slip, grip in points
    ]
    mark_front(rows)
    names = ("frame_us", "slip_mm", "steady")
    for row in rows:
        better = [
            o for o in rows if o["held"] and all(o[n] <= row[n] for n in names) and any(o[n] < row[n] for n in names)
        ]
        assert row["front"] == (row["held"] == 1 and not better)


def compared(*points):
    """Return rows of configurations from (name, held, time, slip, grip); the first is the default."""
    rows = [
        {"configuration": name, "held": held, "frame_us": time, "slip_mm": slip, "steady": grip, "default": not at}
        for at, (name, held, time, slip, grip) in enumerate(points)
    ]
    mark_front(rows)
    return rows


def test_the_note_states_whether_the_default_is_on_the_front_or_what_beats_it():
    usual = ("usual", 1.0, 900.0, 2.0, 1.4)
    assert default_note(compared(usual, ("quick", 1.0, 300.0, 3.0, 1.4))) == ["the default, usual, is on the front"]
    (beaten,) = default_note(compared(usual, ("slow", 1.0, 890.0, 2.0, 1.4), ("better", 1.0, 800.0, 1.9, 1.4)))
    assert beaten == "the default, usual, is not on the front: better is at least as good in everything"
    (dropped,) = default_note(compared(("usual", 0.9, 900.0, 2.0, 1.4)))
    assert dropped.endswith("is not on the front: it dropped some")
    assert default_note([row | {"default": False} for row in compared(usual)]) == []


def test_the_default_is_the_configuration_of_a_run_without_a_config():
    config = load_config(None)
    assert default_configuration().backends() == {
        kind: config.section(kind).backend for kind in ("tracker", "detector", "estimator", "controller")
    }
    assert default_configuration().budget_ms == (config.tactile.budget_ms or 0.0)


def test_the_chart_is_drawn_and_choose_goes_on_from_its_lifts(run, tmp_path, monkeypatch):
    runs, picture, rig = tmp_path / "loop.jsonl", tmp_path / "loop.png", tmp_path / "rig.toml"
    code, out, err = run("study", "loop", *FEW, "--out", str(runs), "--plot", str(picture), "--json", "-")
    assert code == 0, err
    rows = json.loads(out[out.index("{") :])["configurations"]
    assert {row["controller"] for row in rows} == {"belief", "pd"}
    assert any(row["front"] for row in rows)
    assert picture.stat().st_size > 5000

    few = {"trackers": ["lk"], "pairs": ["threshold+field"], "objects": ["pvc-pipe"], "squeezes_mm": [1.0]}
    from lsds_research.studies.loop import options

    whole = options.LoopOptions
    monkeypatch.setattr(options, "LoopOptions", lambda **own: whole(**few, **own))
    code, out, err = run("study", "choose", "--max-slip", "60mm", "--runs", str(runs), "--out", str(rig))
    assert code == 0, err
    assert out == rig.read_text()
    assert load_config(rig).section("detector").backend == "threshold"
    code, out, err = run("study", "choose", "--max-slip", "1um", "--max-grip", "1.0", "--runs", str(runs))
    assert code == 1
    assert out == ""
    assert "no configuration meets the limits; nearest: lk threshold+field" in err


def test_a_budget_is_a_configuration_of_its_own_and_part_of_the_chosen_rig(run, tmp_path, monkeypatch):
    runs, rig = tmp_path / "loop.jsonl", tmp_path / "rig.toml"
    few = {
        "trackers": ["lk"],
        "pairs": ["fused+fused"],
        "controllers": ["belief"],
        "objects": ["pvc-pipe"],
        "squeezes_mm": [1.4],
    }
    from lsds_research.studies.loop import options

    whole = options.LoopOptions
    monkeypatch.setattr(options, "LoopOptions", lambda **own: whole(**few, **own))
    rows = {}
    for budget in ("0", "1"):
        code, out, err = run(
            "study", "choose", "--max-slip", "60mm", "--budget-ms", budget, "--runs", str(runs), "--out", str(rig)
        )
        assert code == 0, err
        assert load_config(rig).tactile.budget_ms == (float(budget) or None)
        rows[budget] = out
    assert rows["0"] != rows["1"]
    kept = [json.loads(line) for line in runs.read_text().splitlines()]
    for each in kept:
        del each["run"]["frame_mean_us"]
    runs.write_text("".join(json.dumps(each) + "\n" for each in kept))
    code, _, err = run("study", "choose", "--max-slip", "60mm", "--runs", str(runs))
    assert code != 0
    assert "holds lifts of an earlier version" in err


@pytest.mark.parametrize("wrong", ["5", "5kg", "mm", "-1mm"])
def test_a_limit_without_a_unit_is_refused(run, wrong):
    code, _, err = run("study", "choose", f"--max-slip={wrong}")
    assert code == 2
    assert ("is not above zero" if wrong == "-1mm" else "write a number and one of mm, cm, m, um, such as 5mm") in err
    assert "such as 5ms" in run("study", "choose", "--budget=soon")[2]


def test_a_malformed_pair_is_one_line(run):
    code, _, err = run("study", "loop", "--pair", "fused", "--no-plot")
    assert code != 0
    assert "write DETECTOR+ESTIMATOR" in err
