"""Ctrl-C and SIGTERM during a lift end the whole campaign, not only the lift."""

from __future__ import annotations

import signal
import subprocess
import sys

import lsds_research.search.robustness as robustness
import lsds_research.studies.faults.case as faults
import lsds_research.studies.grip.lift as grip
import pytest
from lsds_research.studies.faults.options import FaultsOptions
from lsds_research.studies.faults.study import _planned as planned_faults
from lsds_research.studies.grip.options import GripOptions
from lsds_research.studies.grip.study import _planned as planned_lifts

import lsds
import lsds.session.simulate as simulating
from lsds.cli.main import main

pytestmark = pytest.mark.usefixtures("installed_host")
QUICK = ("cell.simulated.fidelity=winkler", "task.lift_s=0.3", "task.hold_s=0.2")


@pytest.fixture(scope="module")
def interrupted():
    def interrupt(cycle):
        raise KeyboardInterrupt

    session = lsds.run(overrides=QUICK, observe=interrupt)
    assert isinstance(session.fault, KeyboardInterrupt)
    return session


@pytest.mark.parametrize(
    ("module", "work"),
    [
        (robustness, lambda: robustness.run_scenario(({}, robustness.Limits(), QUICK))),
        (faults, lambda: faults.run_case(faults.Case("belief", "fused", 1))),
        (grip, lambda: grip.lift(grip.Lift("belief", "pvc-pipe", 1.0, 0.08, 1.0, "none", 1, 3.0))),
        (simulating, lambda: list(lsds.simulate([QUICK]))),
    ],
)
def test_an_interrupted_lift_interrupts_its_campaign(module, work, interrupted, monkeypatch):
    monkeypatch.setattr(module, "run", lambda *_, **__: interrupted)
    with pytest.raises(KeyboardInterrupt):
        work()


def test_an_interrupted_study_names_the_file_from_which_it_continues(interrupted, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(grip, "run", lambda *_, **__: interrupted)
    out = tmp_path / "runs.jsonl"
    assert main(["study", "grip", "--object", "ball", "--jobs", "1", "--out", str(out), "--no-plot"]) == 130
    assert f"the runs so far are in {out}; the same command continues from there" in capsys.readouterr().err


def test_quick_leaves_out_nothing_that_is_named():
    named = FaultsOptions(faults=["gripper-stuck", "camera-noise"], quick=True)
    assert {case.fault for case in planned_faults(named, 1)} == {"", "gripper-stuck", "camera-noise"}
    objects = GripOptions(objects=["ball", "can"], controllers=["belief"], quick=True)
    assert {lift.object for lift in planned_lifts(objects, 1)} == {"ball", "can"}


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_study_in_one_process_ends_when_asked(number, tmp_path):
    command = [sys.executable, "-m", "lsds", "study", "faults", "--quick", "--jobs", "1", "--no-plot"]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as study:
        try:
            assert study.stderr is not None
            while " of " not in study.stderr.readline():
                assert study.poll() is None
            study.send_signal(number)
            assert study.wait(30) == 128 + number
        finally:
            study.kill()
