"""`lsds study faults`: runs next to those without, on one process or two, and its statistics."""

from __future__ import annotations

import json

import pytest
from lsds_research.studies.faults.paired import holm, mcnemar
from lsds_research.studies.faults.study import _judged

from lsds.cli.main import main

ASKED = ("study", "faults", "--fault", "gripper-stuck", "--fault", "camera-dark", "--severity", "1")


def test_mcnemars_exact_test_and_holms_correction():
    pairs = [(True, False)] * 8 + [(False, True)] + [(True, True)] * 5
    assert mcnemar(pairs) == pytest.approx(2 * (1 + 9) / 2**9)
    assert mcnemar([(True, True)]) == 1.0
    assert holm({"a": 0.01, "b": 0.04, "c": 0.03}) == pytest.approx({"a": 0.03, "c": 0.06, "b": 0.06})


def test_a_stuck_gripper_is_stopped_a_dim_light_does_no_harm_on_any_number_of_processes(tmp_path, capsys):
    results = []
    for jobs in ("1", "2"):
        file = tmp_path / f"{jobs}.json"
        kept = tmp_path / f"{jobs}.jsonl"
        asked = [*ASKED, "--moment", "slip", "--jobs", jobs, "--out", str(kept), "--json", str(file)]
        assert main([*asked, "--plot", str(tmp_path / "faults.png")]) == 0
        results.append(json.loads(file.read_text()))
    runs = {run["fault"]: run for run in results[0]["runs"]}
    assert (runs["gripper-stuck"]["verdict"], runs["gripper-stuck"]["error"]) == ("stopped", "SafetyStop")
    assert runs["camera-dark"]["verdict"] == "harmless"
    assert not any(run["opened"] for run in results[0]["runs"])
    assert results[0]["runs"] == results[1]["runs"]
    assert (tmp_path / "faults.png").stat().st_size > 5000
    # The same command goes on where it ended.
    assert main([*asked]) == 0
    assert len(kept.read_text().splitlines()) == 3


def test_an_unknown_fault_is_named(capsys):
    assert main(["study", "faults", "--fault", "gripper-stuk"]) == 3
    assert "gripper-stuck" in capsys.readouterr().err


def row(**own):
    usual = {"error": None, "unnamed": False, "outcome": "held", "peak_n": 4.0, "began": True, "moment": "hold"}
    return usual | {"apertures_m": {"hold": [0.030, 0.0301]}} | own


@pytest.mark.parametrize(
    ("own", "without", "verdict"),
    [
        ({}, {}, "harmless"),
        ({"outcome": "dropped"}, {}, "missed"),
        ({"error": "SafetyStop", "outcome": "fault"}, {}, "stopped"),
        ({"error": "PluginError", "unnamed": True, "outcome": "fault"}, {}, "unnamed"),
        ({"began": False, "error": "PluginError", "unnamed": True}, {}, ""),
        ({"outcome": "dropped"}, {"outcome": "dropped"}, ""),
        ({"outcome": "fault", "error": "SafetyStop"}, {"outcome": "fault", "error": "SafetyStop"}, ""),
        ({}, {"outcome": "outside the model's validity"}, "harmless"),
    ],
)
def test_the_verdict_on_a_run_with_a_fault(own, without, verdict):
    """A crash counted as stopped, and a run whose fault never began, or without anything held, as harmless."""
    assert _judged(row(**own), row(**without))["verdict"] == verdict


@pytest.mark.parametrize(
    ("own", "without", "opened"),
    [
        ([0.030, 0.0329], [0.030, 0.0301], True),
        ([0.030, 0.0329], None, True),
        ([0.030, 0.0329], [0.030, 0.0325], False),
        (None, [0.030, 0.0301], False),
    ],
)
def test_fingers_open_if_they_do_by_more_than_in_the_same_stage_without_the_fault(own, without, opened):
    judged = _judged(row(apertures_m={"hold": own}), row(apertures_m={"hold": without}))
    assert judged["opened"] is opened
