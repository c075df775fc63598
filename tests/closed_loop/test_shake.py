"""The job `shake`, and `lsds calibrate slip` on the rig that it moves."""

from __future__ import annotations

import json
import tomllib

import pytest
from click.testing import CliRunner
from lsds_plugins.jobs.shake import ShakeJob, ShakeOptions

from lsds.cli.main import cli
from lsds.contracts import Setting, Situation
from lsds.session.run import run
from lsds.task import TaskOptions

QUICK = ["task.settle_s=0.2", "cell.simulated.fidelity=pad", "cell.simulated.grid=1", "cell.simulated.step_ms=4.0"]


def test_it_grips_closer_shakes_to_and_fro_and_ends_where_it_began():
    job = ShakeJob(ShakeOptions(closer_mm=3.0, still_s=0.5, lift_s=1.0, shakes=2, rates_hz=[2.0]))
    job.begin(Setting(0, TaskOptions(grip_aperture_m=0.02)))
    stages, height, t_ms = [], 0.0, 0
    while True:
        wanted = job.step(Situation(t_ms * 1_000_000, referenced=True, arrived=t_ms > 100))
        if wanted.grip is not None:
            assert wanted.grip.aperture_m == pytest.approx(0.017)
        if not stages or stages[-1] != wanted.stage:
            stages.append(wanted.stage)
        if wanted.done:
            break
        height += 1e-3 * (0.0 if wanted.twist is None else wanted.twist.linear_m_s[2])
        assert height >= -1e-3
        assert not wanted.corrects
        t_ms += 1
    assert stages == ["grasp", "still", "lift", "shake", "lower", "still", "done"]
    assert height == pytest.approx(0, abs=1e-3)


def test_a_firmly_held_pipe_is_shaken_and_does_not_slip():
    session = run(None, [*QUICK, "job.backend=shake", "job.shake.still_s=0.3", "job.shake.shakes=2"])
    assert session.fault is None
    assert max(truth.slip_distance_m for truth in session.truths) == 0
    loads = [truth.tangential_force_n for truth in session.truths if truth.object_height_m > 0]
    assert max(loads) > 1.1 * min(loads) > 0, "shaking changes the load"


def test_calibrating_on_the_simulated_rig_writes_a_file_that_runs(tmp_path):
    out, told = tmp_path / "slip.toml", tmp_path / "told.json"
    flags = [part for each in QUICK for part in ("--set", each)]
    arguments = ["calibrate", "slip", *flags, "--out", str(out), "--json", str(told)]
    result = CliRunner().invoke(cli, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    summary = json.loads(told.read_text())
    names = [each["name"] for each in summary["detectors"]]
    assert names == ["fused", "imprint"]
    assert summary["moving"] > 40
    assert summary["slides"] == 1
    for each in summary["detectors"]:
        assert each["after"]["per_100_moving"] <= max(each["before"]["per_100_moving"], 8)
        assert each["after"]["noticed"] == 1, "a pipe that slides is noticed all the same"
    assert "gel_share" in tomllib.loads(out.read_text())["estimator"]["fused"]
    caught = run(None, [*QUICK, f'calibration=["{out}"]'])
    assert caught.summary["outcome"] == "held"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--out", "slip.json"], "must end in .toml"),
        (["--set", "arm.backend=none"], "add --by-hand"),
        (["--load", "nowhere.avi"], "nowhere.avi"),
        (["--detector", "imprnt"], "imprnt"),
    ],
)
def test_what_cannot_be_calibrated_is_said(tmp_path, monkeypatch, arguments, says):
    monkeypatch.chdir(tmp_path)
    from lsds.cli.main import main

    assert main(["calibrate", "slip", *arguments]) not in (0, 1)
