"""`lsds study faults`: runs next to those without, on one process or two, and its statistics."""

from __future__ import annotations

import json

import pytest
from lsds_research.studies.faults.case import Case, run_case
from lsds_research.studies.faults.options import FaultsOptions
from lsds_research.studies.faults.paired import holm, mcnemar, sign_test
from lsds_research.studies.faults.study import _bounds_note, _compared, _judged, _others_note, _planned, _summary, _unit

from lsds.cli.main import main
from lsds.config import load_config

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


def judged(seed, verdict="harmless", **own):
    usual = {"fault": "f", "severity": 0, "moment": "hold", "controller": "c", "detector": "d", "error": None}
    return usual | {"seed": seed, "verdict": verdict, "opened": False, "squeezed": False, "safe_s": None} | own


def test_the_bound_counts_gels_and_not_their_dependent_runs():
    none_missed = _summary("all", [judged(seed) for seed in range(10) for _ in range(200)])
    assert (none_missed["runs"], none_missed["gels"], none_missed["missed_gels"]) == (2000, 10, 0)
    assert none_missed["missed_most"] == pytest.approx(1 - 0.05 ** (1 / 10))
    one_gel = _summary("all", [judged(seed, "missed" if seed == 3 else "harmless") for seed in range(10) for _ in "ab"])
    assert (one_gel["missed"], one_gel["missed_gels"]) == (pytest.approx(0.1), 1)
    # P(at most 1 of 10 gels | the bound) = 5 %.
    bound = one_gel["missed_most"]
    assert (1 - bound) ** 10 + 10 * bound * (1 - bound) ** 9 == pytest.approx(0.05)


def test_the_output_states_runs_gels_and_what_the_bound_is_about():
    rows = [judged(seed, opened=seed == 3) for seed in range(10) for _ in range(200)]
    text = _bounds_note(_summary("all", rows), "gels")
    assert "missed: 0 of 2000 runs, on 0 of 10 gels; at most 26 % of gels" in text
    assert "opened: 200 of 2000 runs, on 1 of 10 gels; at most 39 % of gels" in text
    assert "95 % confidence" in text
    assert "not independent" in text


def test_seeds_are_not_gels_if_the_rig_or_a_setting_fixes_the_gel():
    assert _unit(FaultsOptions()) == "gels"
    assert _unit(FaultsOptions(rig="rig.toml")) == "seeds"
    assert _unit(FaultsOptions(settings=["sensor.mock-gelsight-mini.gel=3"])) == "seeds"


def test_the_sign_test_is_exact_and_leaves_out_ties():
    assert sign_test([3, 1, 1, 2, 5, 1, 1, 9, -1, 0, 0]) == pytest.approx(2 * (1 + 9) / 2**9)
    assert sign_test([]) == sign_test([0, 0]) == 1.0


def test_the_comparison_of_controllers_is_over_gels_with_mcnemar_over_runs_beside_it():
    """Many runs on one bad gel made a large difference of one case."""
    rows = [
        judged(seed, "missed" if who == "b" and seed == 0 else "harmless", controller=who, severity=severity)
        for who in "ab"
        for seed in range(10)
        for severity in range(8)
    ]
    (table,) = _compared(rows, "gels")
    (found,) = table.rows
    assert (found["pair"], found["runs"], found["missed"]) == ("a, b", 80, "0 and 8")
    assert (found["gels"], found["worse"]) == (10, "0 and 1")
    assert found["p"] == 1.0
    assert found["p_runs"] == pytest.approx(2 / 2**8)
    assert [heading for _, heading, _ in table.columns][-2:] == ["p over gels (Holm)", "McNemar over runs (Holm)"]


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


FAST = ("task.lift_s=0.3", "task.hold_s=0.2", "cell.simulated.fidelity=winkler")


@pytest.mark.parametrize("fault", ["detector-raises", "controller-raises", "tracker-raises", "estimator-raises"])
def test_an_exception_that_a_fault_raises_on_purpose_has_the_name_of_its_part(fault, installed_host):
    row = run_case(Case("belief", "fused", 1, fault, 0, "lift", settings=FAST))
    assert row["error"] == "PluginError"
    assert not row["unnamed"]


def test_an_exception_of_the_project_under_a_fault_is_unnamed(installed_host, monkeypatch):
    monkeypatch.setattr("lsds.grip.observer.GripObserver.update", lambda *_, **__: 1 / 0)
    row = run_case(Case("belief", "fused", 1, "detector-silent", 0, "lift", settings=FAST))
    assert row["unnamed"]


@pytest.mark.parametrize("key", ["controller.backend=pd", "detector.backend = imprint", "seed=7"])
def test_a_setting_that_the_study_varies_is_refused(key, capsys):
    """It would make all runs one, which counted as different controllers or seeds."""
    assert main(["study", "faults", "--fault", "gripper-late", "--with", key, "--no-plot"]) == 2
    assert "this study sets the key itself" in capsys.readouterr().err


def test_a_table_that_sets_what_the_study_varies_is_refused(capsys):
    assert main(["study", "faults", "--with", 'controller={backend="pd"}', "--no-plot"]) == 2
    assert "this study sets the key itself" in capsys.readouterr().err


@pytest.mark.parametrize("setting", ["job.backend=watch", "job.backend=hold"])
def test_a_job_that_never_ends_is_refused(setting, capsys):
    assert main(["study", "faults", "--with", setting, "--no-plot"]) == 2
    assert "never ends by itself" in capsys.readouterr().err


def test_a_job_with_a_duration_ends():
    settings = ["job.backend=watch", "job.watch.duration_s=1"]
    assert _planned(FaultsOptions(faults=["camera-dark"], settings=settings), 0)


def test_an_exception_that_a_rigs_own_fault_raises_is_named(tmp_path, installed_host):
    rig = tmp_path / "rig.toml"
    rig.write_text('[[faults]]\nbackend = "detector-raises"\nat = "lift"\n', "utf-8")
    row = run_case(Case("belief", "fused", 1, settings=FAST, rig=str(rig)))
    assert row["error"] == "PluginError"
    assert not row["unnamed"]


def test_a_rig_keeps_its_own_faults_under_the_one_that_is_tested(tmp_path):
    """The run without the fault had them, the run with it did not."""
    rig = tmp_path / "rig.toml"
    rig.write_text('[[faults]]\nbackend = "gripper-slow"\nseverity = 1\n', "utf-8")
    config = load_config(rig, Case("belief", "fused", 1, "camera-noise", 3, "lift", rig=str(rig)).overrides())
    assert [fault.backend for fault in config.faults] == ["gripper-slow", "camera-noise"]


def test_errors_in_runs_that_are_not_judged_are_stated():
    quiet = {"unnamed": False, "arm_moves_after_stop": None}
    assert _others_note([quiet, quiet]) == []
    (note,) = _others_note([quiet | {"unnamed": True}, quiet | {"opened": True, "arm_moves_after_stop": 2}])
    assert "2 runs that were left out or have no fault: 1 unnamed errors, 1 opened, and 1 with arm commands" in note


@pytest.mark.parametrize("severity", ["0", "6"])
def test_a_severity_out_of_range_is_refused_before_any_lift(severity, capsys):
    assert main(["study", "faults", "--severity", severity, "--no-plot"]) == 2
    assert "severities" in capsys.readouterr().err


def test_quick_keeps_what_is_given():
    given = FaultsOptions(quick=True, faults=["gripper-late"], severities=[1, 1], moments=["hold", "hold"], seeds=3)
    assert {(case.severity, case.moment) for case in _planned(given, 0) if case.fault} == {(1, "hold")}
    assert len(_planned(given, 0)) == 3 + 3
    assert {case.severity for case in _planned(FaultsOptions(quick=True, faults=["gripper-late"]), 0)} == {0, 3, 5}


def test_a_rig_is_tested_with_its_own_controller_detector_and_task(tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text('[controller]\nbackend = "pd"\n[detector]\nbackend = "imprint"\n[task]\nhold_s = 2.5\n', "utf-8")
    options = FaultsOptions(rig=str(rig), faults=["gripper-late"], severities=[5], moments=["lift"])
    cases = _planned(options, 0)
    assert {(case.controller, case.detector) for case in cases} == {("pd", "imprint")}
    texts = cases[0].overrides()
    assert not [text for text in texts if text.startswith("task.hold_s")]
    assert "task.lift_s=1.2" in texts
    named = options.model_copy(update={"controllers": ["belief"]})
    assert {case.controller for case in _planned(FaultsOptions.model_validate(named.model_dump()), 0)} == {"belief"}
