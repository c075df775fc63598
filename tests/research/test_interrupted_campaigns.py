"""Ctrl-C and SIGTERM during a lift end the whole campaign, not only the lift."""

from __future__ import annotations

import signal
import subprocess
import sys

import lsds_research.search.robustness as robustness
import lsds_research.studies.faults.case as faults
import lsds_research.studies.grip.lift as grip
import pytest

import lsds
import lsds.session.simulate as simulating

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
