"""The job `shake`, and `lsds calibrate slip` on the rig that it moves."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path

import pytest
from lsds_plugins.jobs.shake import ShakeJob, ShakeOptions
from pydantic import ValidationError

from lsds.cli.main import main
from lsds.config import RigConfig
from lsds.contracts import ArmState, Pose, Setting, Situation, Twist
from lsds.errors import ConfigError
from lsds.rig import Rig
from lsds.session.run import run
from lsds.task import TaskOptions

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "rigs"

QUICK = ["task.settle_s=0.2", "cell.simulated.fidelity=pad", "cell.simulated.grid=1", "cell.simulated.step_ms=4.0"]


SPEC_GRIPPER, SPEC_ARM = (Rig(RigConfig()).gripper.spec, Rig(RigConfig()).arm.spec)


class Arm:
    """An arm that follows a wanted velocity with an acceleration, told 20 ms late."""

    def __init__(self, acceleration):
        self.height, self.speed, self.told, self._acceleration = 0.3, 0.0, [0.3] * 20, acceleration

    def state(self, t_ms):
        return ArmState(t_ms * 1_000_000, t_ms, Pose((0.0, 0.0, self.told[0]), (0.0, 0.0, 0.0, 1.0)), Twist())

    def step(self, wanted):
        limit = self._acceleration * 1e-3
        self.speed += min(max(wanted - self.speed, -limit), limit)
        self.height += 1e-3 * self.speed
        self.told = [*self.told[1:], self.height]


@pytest.mark.parametrize("acceleration", [0.15, 0.5, 3.0])
@pytest.mark.parametrize("rates", [[2.0], [0.5, 3.0]])
def test_it_grips_closer_shakes_to_and_fro_and_never_gets_below_where_it_began(acceleration, rates):
    job = ShakeJob(ShakeOptions(closer_mm=3.0, still_s=0.5, lift_s=1.0, shakes=2, rates_hz=rates, speed_m_s=0.1))
    task = TaskOptions(grip_aperture_m=0.02, lift_acceleration_m_s2=acceleration)
    job.begin(Setting(0, task, SPEC_GRIPPER, SPEC_ARM))
    arm, stages, lowest, highest, t_ms = Arm(acceleration), [], 1.0, 0.0, 0
    while True:
        wanted = job.step(Situation(t_ms * 1_000_000, referenced=True, arrived=t_ms > 100, arm=arm.state(t_ms)))
        if wanted.grip is not None:
            assert wanted.grip.aperture_m == pytest.approx(0.017)
        if not stages or stages[-1] != wanted.stage:
            stages.append(wanted.stage)
        if wanted.done:
            break
        assert not wanted.corrects
        arm.step(0.0 if wanted.twist is None else wanted.twist.linear_m_s[2])
        lowest, highest = min(lowest, arm.height), max(highest, arm.height)
        t_ms += 1
        assert t_ms < 60_000
    assert stages == ["grasp", "still", "lift", "shake", "lower", "still", "done"]
    assert lowest >= 0.3 - 1e-4
    assert highest > 0.32
    assert arm.height - 0.3 < 0.02


def test_without_an_arm_it_does_not_begin():
    with pytest.raises(ConfigError, match="needs a gripper and an arm"):
        ShakeJob().begin(Setting(0, TaskOptions(), SPEC_GRIPPER))


@pytest.mark.parametrize("rates", [[], [0.0], [-1.0], [math.nan], [0.01], [100.0]])
def test_rates_that_make_no_sense_are_refused(rates):
    with pytest.raises(ValidationError):
        ShakeOptions(rates_hz=rates)


def test_a_firmly_held_pipe_is_shaken_and_does_not_slip():
    session = run(None, [*QUICK, "job.backend=shake", "job.shake.still_s=0.3", "job.shake.shakes=2"])
    assert session.fault is None
    assert max(truth.slip_distance_m for truth in session.truths) == 0
    loads = [truth.tangential_force_n for truth in session.truths if truth.object_height_m > 0]
    assert max(loads) > 1.1 * min(loads) > 0, "shaking changes the load"
    assert session.truths[-1].object_height_m < 0.01, "it ends a little above where it stood"


def test_calibrating_on_the_simulated_rig_writes_a_file_that_runs(tmp_path):
    out, told = tmp_path / "slip.toml", tmp_path / "told.json"
    flags = [part for each in QUICK for part in ("--set", each)]
    assert main(["calibrate", "slip", *flags, "--out", str(out), "--json", str(told)]) == 0
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
        (["--by-hand", "--load", "a.avi"], "leave the recordings out"),
        ([str(EXAMPLES / "hardware.toml")], "only a simulated rig moves by itself"),
    ],
)
def test_what_cannot_be_calibrated_is_said(tmp_path, monkeypatch, capsys, arguments, says):
    monkeypatch.chdir(tmp_path)
    assert main(["calibrate", "slip", *arguments]) not in (0, 1)
    assert says in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_by_hand_says_what_to_do_once_the_untouched_gel_was_seen(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["calibrate", "slip", "--by-hand", "--seconds", "2"]) != 0
    said = capsys.readouterr().err
    asked = ["do not touch the gel", "put the object into the grip", "hold it still", "wriggle it (", "pull it slowly"]
    at = [said.index(each) for each in asked]
    assert at == sorted(at)
    # Nobody has moved anything.
    assert "0 of 40 frames in which the gel moves (wriggle more)" in said


def test_a_threshold_of_the_config_s_own_is_pointed_out(tmp_path):
    rig, out, told = tmp_path / "rig.toml", tmp_path / "slip.toml", tmp_path / "told.json"
    rig.write_text("[detector.fused]\nthreshold = 0.9\n")
    flags = [part for each in QUICK for part in ("--set", each)]
    assert main(["calibrate", "slip", str(rig), *flags, "--out", str(out), "--json", str(told)]) == 0
    assert "the config sets detector.fused.threshold itself" in json.loads(told.read_text())["warnings"][0]
