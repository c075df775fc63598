"""One verdict on each lift: `lsds run`, the studies and the search agree, and odd objects end with the reason."""

from __future__ import annotations

import json
import re

import pytest
from lsds_research.search.robustness import Limits, run_scenario
from lsds_research.studies.faults.case import Case, run_case
from lsds_research.studies.grip.lift import Lift, lift

import lsds
from lsds.cli.main import main
from lsds.session.verdict import Outcome

pytestmark = pytest.mark.usefixtures("installed_host")
QUICK = ("cell.simulated.fidelity=winkler", "task.lift_s=1.0", "task.hold_s=0.5")


def printed_verdict(tmp_path, *arguments):
    """Run `lsds run`; return its verdict in the JSON, after checking the exit code against it."""
    file = tmp_path / "run.json"
    code = main(["run", *arguments, "--no-plot", "--json", str(file)])
    verdict = json.loads(file.read_text())["verdict"]
    assert code == verdict["exit_code"]
    return verdict


def sets(overrides):
    return [word for text in overrides for word in ("--set", text)]


# -- eight odd objects ----------------------------------------------------------------------------------------

SLIPPERY = ("cell.simulated.static_friction=0.06", "cell.simulated.kinetic_friction=0.05")
SWINGING = 'faults=[{backend="camera-flicker", at="lift", severity=5}]'
ODD = {
    "5 g": (("cell.simulated.mass_kg=0.005",), r"held: with 31 times the greatest force needed, after 0 mm of slip"),
    "2 kg": (("cell.simulated.mass_kg=2",), r"outside the model's validity: indentation is 31% of the thickness"),
    "slippery": (SLIPPERY, r"outside the model's validity: indentation is 42% of the thickness"),
    "soft": (
        ("cell.simulated.stiffness_n_mm=0.3",),
        r"dropped: slip was not detected for 1\.2 s, and the grip reached 1\.\d+ N of the 2\.81 N needed",
    ),
    "wide": (
        ("cell.simulated.diameter_mm=45", "gripper.mock-hand-e.stroke_mm=40"),
        r"stopped: the object is wider than the gripper opens, 40 mm; SafetyStop: task",
    ),
    "limit": (("task.fragile_n=1.5",), r"dropped: the force limit of 1\.5 N \(task\.fragile_n\) cannot hold 2\.81 N"),
    "light": ((SWINGING,), r"stopped: SafetyStop: sensor: nothing usable .* the whole image changes by \d+ levels"),
    "none": (
        ("cell.simulated.diameter_mm=4", "safety.min_aperture_m=0.01"),
        r"stopped: SafetyStop: task: nothing there: the fingers have closed to 10\.0 mm",
    ),
}


@pytest.mark.parametrize("name", ODD)
def test_an_odd_object_ends_in_a_sentence_that_names_the_reason(name):
    overrides, sentence = ODD[name]
    session = lsds.run(overrides=[*QUICK, *overrides])
    assert re.match(sentence, session.verdict.sentence), session.verdict.sentence
    assert session.summary["verdict"]["sentence"] == session.verdict.sentence


@pytest.mark.parametrize(
    ("overrides", "code", "shown"),
    [
        (("task.grip_aperture_m=0.04",), 11, "not lifted"),
        pytest.param(("task.max_slip_m=0.0005",), 9, "slipped too far", marks=pytest.mark.slow),
        pytest.param(("task.max_grip_ratio=1.2",), 10, "crushed", marks=pytest.mark.slow),
        pytest.param(("cell.simulated.mass_kg=2",), 12, "outside the model's validity", marks=pytest.mark.slow),
    ],
)
def test_the_printed_outcome_the_json_and_the_exit_code_agree(tmp_path, capsys, overrides, code, shown):
    verdict = printed_verdict(tmp_path, *sets([*QUICK, *overrides]))
    printed = capsys.readouterr().out
    assert (verdict["outcome"], verdict["exit_code"]) == (shown, code)
    assert f"{shown} (simulated)" in printed
    assert verdict["reason"] in printed


# -- the studies and the search agree with `lsds run` ---------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("settings", [(), ("task.max_grip_ratio=1.2",), ("cell.simulated.mass_kg=2",)])
def test_the_study_of_grip_agrees(tmp_path, settings):
    planned = Lift("belief", "pvc-pipe", 1.0, 0.08, 1.0, "none", 1, 3.0, settings=(QUICK[0], *settings))
    row = lift(planned)
    verdict = printed_verdict(tmp_path, *sets(planned.overrides()))
    assert (row["outcome"], row["sentence"]) == (verdict["outcome"], verdict["sentence"])
    assert row["held"], "the object is in the grip in each of these lifts"


@pytest.mark.slow
@pytest.mark.parametrize("fault", [("detector-silent", "start"), ("camera-gone", "lift")])
def test_the_study_of_faults_agrees(tmp_path, fault):
    case = Case("belief", "fused", 1, fault[0], 0, fault[1], settings=QUICK)
    row = run_case(case)
    verdict = printed_verdict(tmp_path, *sets(case.overrides()))
    assert row["sentence"] == verdict["sentence"]
    assert (row["outcome"] == "fault") == (verdict["outcome"] == "stopped")


FAILURES = {Outcome.DROPPED, Outcome.NOT_LIFTED, Outcome.CRUSHED, Outcome.SLIPPED}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limits", "settings"),
    [
        (Limits(), ()),
        (Limits(peak=1.2), ()),
        (Limits(slip_m=0.0005), ()),
        (Limits(), ("controller.enabled=false",)),
        (Limits(), ("cell.simulated.mass_kg=2",)),
    ],
)
def test_a_margin_of_the_search_is_below_zero_if_and_only_if_the_verdict_is_a_failure(limits, settings):
    row = run_scenario(({}, limits, (*QUICK, *settings)))
    session = lsds.run(overrides=[*limits.overrides(), *QUICK, *settings])
    assert row["sentence"] == session.verdict.sentence
    assert (min(row["margins"].values()) < 0) == (session.verdict.outcome in FAILURES)


@pytest.mark.slow
@pytest.mark.parametrize("limit", [("--peak", "1.1"), ("--slip-mm", "0.2")])
def test_a_failure_that_search_has_saved_fails_the_same_way_in_run(tmp_path, limit):
    space = tmp_path / "space.toml"
    space.write_text("[task]\nlift_speed_m_s = [0.03, 0.08]\nfirst_squeeze_m = [0.0006, 0.0012]\n")
    found = tmp_path / "found"
    asked = ["study", "search", "--runs", "8", "--most", "2", "--space", str(space), "--found", str(found), *limit]
    asked += [word for text in QUICK for word in ("--with", text)]
    assert main([*asked, "--no-plot", "--json", str(tmp_path / "search.json")]) == 0
    saved = json.loads((tmp_path / "search.json").read_text())["found"]
    assert saved
    for failure in saved:
        verdict = printed_verdict(tmp_path, failure["file"])
        assert verdict["outcome"] in FAILURES
        assert verdict["sentence"] == failure["sentence"]
