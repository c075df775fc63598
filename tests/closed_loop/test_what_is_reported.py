"""A run that does not end well states why, and claims nothing about devices that it could not reach."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

import lsds
from lsds.cli.main import cli
from lsds.cli.run_summary import full_table, short_table
from lsds.errors import ConfigError
from lsds.jobs import HoldJob

pytestmark = pytest.mark.usefixtures("installed_host")
QUICK = ("cell.simulated.fidelity=winkler", "task.lift_s=1.0", "task.hold_s=0.5")


def run(*overrides):
    return lsds.run(overrides=[*QUICK, *overrides])


def fault(backend, at="lift"):
    return f'faults=[{{backend="{backend}", at="{at}"}}]'


# -- arm and gripper after a fault ----------------------------------------------------------------------------


@pytest.mark.parametrize("gone", ["arm-gone", "arm-frozen"])
def test_an_arm_that_cannot_be_reached_is_not_reported_as_stopped(gone):
    session = run(fault(gone))
    report = session.summary["stop_report"]
    assert session.summary["outcome"] == "fault"
    assert "the arm could not be reached" in report
    assert "so it may still be moving; its last command was 0.0" in report
    assert "the gripper was commanded to stay where it is: its last command was 2" in report
    assert report in session.fault.__notes__
    assert "was stopped" not in str(session.fault)
    assert "grip kept" not in str(session.fault)


def test_a_gripper_that_cannot_be_reached_is_not_reported_to_keep_the_grip():
    report = run(fault("gripper-no-power")).summary["stop_report"]
    assert "the arm was commanded to stop" in report
    assert "the gripper could not be reached" in report
    assert "its last command was 2" in report


def test_devices_that_answer_are_reported_as_commanded():
    report = run(fault("camera-gone")).summary["stop_report"]
    assert report.startswith("the arm was commanded to stop; the gripper was commanded to stay where it is")
    assert "reached" not in report


def test_a_run_that_ends_well_reports_no_stop():
    summary = run().summary
    assert (summary["stop_report"], summary["missing"], summary["outcome_reason"]) == (None, {}, None)


# -- figures that are missing ---------------------------------------------------------------------------------


class GoneCamera:
    """A pose source that sends nothing from some time on."""

    def __init__(self, source, after_ns):
        self._source, self._after_ns = source, after_ns

    def __getattr__(self, name):
        return getattr(self._source, name)

    def read(self):
        from lsds.errors import StaleData

        sample = self._source.read()
        if sample.t_ns > self._after_ns:
            raise StaleData("truth", "no picture for 1.2 s: connection refused")
        return sample


def test_a_pose_source_that_disappears_is_named_with_its_figure(monkeypatch):
    from lsds.runtime.rig import Rig

    build = Rig._build

    def building(self, kind, section, finger=""):
        part = build(self, kind, section, finger)
        return GoneCamera(part, 3_000_000_000) if kind == "pose_source" else part

    monkeypatch.setattr(Rig, "_build", building)
    summary = run("pose_source.backend=mock-truth-camera").summary
    assert summary["outcome"] == "held"
    assert summary["seen_slip_distance_m"] is None
    assert summary["missing"] == {
        "seen_slip_distance_m": "pose source 'mock-truth-camera': truth: no picture for 1.2 s: connection refused"
    }
    for table in (short_table, full_table):
        assert "held (simulated); not measured: seen_slip_distance_m" in table(summary)


def test_nothing_is_missing_while_the_pose_source_sees_the_object():
    summary = run("pose_source.backend=mock-truth-camera").summary
    assert summary["seen_slip_distance_m"] is not None
    assert summary["missing"] == {}


# -- reasons --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("backend", ["lift", "hold", "slide", "shake"])
def test_a_fault_of_a_stage_that_does_not_exist_is_an_error_before_anything_connects(backend):
    with pytest.raises(ConfigError, match=r"faults\.0\.at: 'camera-noise' is to begin at 'lft'.*one of: start, slip"):
        run(fault("camera-noise", "lft"), f"job.backend={backend}")


def test_a_misspelled_stage_is_suggested_and_the_command_fails():
    done = CliRunner().invoke(cli, ["run", "--no-plot", "--fault", "camera-noise:5@lft"])
    assert isinstance(done.exception, ConfigError)
    assert "did you mean 'lift'?" in str(done.exception)


def test_the_stages_of_the_job_that_is_run_count():
    assert "hold" in HoldJob.stages
    with pytest.raises(ConfigError, match="'take up'"):
        lsds.run(overrides=[*QUICK, fault("camera-noise", "take up")], job=HoldJob())


@pytest.mark.parametrize("own", [(), ("job.backend=slide",), ("job.backend=shake",), ("task.probe=true",)])
def test_jobs_declare_all_their_stages(own):
    with lsds.bring_up(overrides=[*QUICK, *own]) as engine:
        engine.run()
        assert set(engine.rig.stages.names) <= {"start", "slip", *engine.job.stages}


def test_a_fragile_object_that_cannot_be_held_is_the_reason_of_the_drop():
    summary = lsds.run(overrides=["task.fragile_n=2.0"]).summary
    assert summary["outcome"] == "dropped"
    assert summary["outcome_reason"].startswith(
        "the force limit of 2 N (task.fragile_n) cannot hold 2.81 N; it held the"
    )
    assert json.dumps(summary["outcome_reason"])


def test_a_drop_for_another_reason_is_not_blamed_on_it():
    summary = lsds.run(overrides=["controller.enabled=false"]).summary
    assert summary["outcome"] == "dropped"
    assert summary["outcome_reason"].startswith(
        "the controller is off, and the grip reached 1.45 N of the 2.81 N needed"
    )


# -- the imprint ----------------------------------------------------------------------------------------------


def test_a_failure_of_the_imprint_names_the_imprint_and_not_the_detector(monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("no edges")

    monkeypatch.setattr("lsds.tactile.imprint.motion.imprint_motion", broken)
    session = run()
    assert session.summary["outcome"] == "fault"
    assert str(session.fault).startswith("imprint of sensor raised ZeroDivisionError: no edges (a bug in lsds")


def test_the_imprint_has_its_own_time_and_none_if_it_is_not_used():
    assert run().summary["timing"]["imprint_us"]["p50"] > 0
    blind = run("detector.backend=threshold", "estimator.backend=field", "controller.backend=pd")
    assert blind.summary["timing"]["imprint_us"] == {"p50": None, "p99": None}


def test_the_imprint_is_computed_once_a_frame():
    with lsds.bring_up(overrides=[*QUICK, "estimator.backend=imprint", "detector.backend=imprint"]) as engine:
        cycles = sum(1 for _ in engine)
        assert engine.lines[0].imprint.durations_ns.count <= cycles
