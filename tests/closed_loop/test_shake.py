"""The job `shake`, and `lsds calibrate slip` on the rig that it moves."""

from __future__ import annotations

import json
import math
import tomllib
from pathlib import Path

import pytest
from lsds_plugins.jobs.shake import ShakeJob, ShakeOptions
from pydantic import ValidationError

from lsds.calibration import sources
from lsds.calibration.slip import calibrate_slip
from lsds.calibration.sources import built, by_hand, watched_hand, watched_rig
from lsds.cli.main import main
from lsds.config import RigConfig, load_config
from lsds.contracts import ArmState, Pose, Setting, Situation, Twist
from lsds.contracts.task import TaskOptions
from lsds.errors import ConfigError, DataError
from lsds.runtime.rig import Rig
from lsds.session.run import run
from tests.tactile.render import pad_positions, render
from tests.video_files import write_video

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "rigs"

QUICK = ["task.settle_s=0.2", "cell.simulated.fidelity=pad", "cell.simulated.grid=1", "cell.simulated.step_ms=4.0"]


SPEC_GRIPPER, SPEC_ARM = (Rig(RigConfig()).gripper.spec, Rig(RigConfig()).arm.spec)


class Arm:
    """An arm that follows a wanted velocity with an acceleration; its state is 20 ms old."""

    def __init__(self, acceleration):
        self.height, self.speed, self.delayed, self._acceleration = 0.3, 0.0, [0.3] * 20, acceleration

    def state(self, t_ms):
        return ArmState(t_ms * 1_000_000, t_ms, Pose((0.0, 0.0, self.delayed[0]), (0.0, 0.0, 0.0, 1.0)), Twist())

    def step(self, wanted):
        limit = self._acceleration * 1e-3
        self.speed += min(max(wanted - self.speed, -limit), limit)
        self.height += 1e-3 * self.speed
        self.delayed = [*self.delayed[1:], self.height]


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


FEW = ["job.shake.still_s=4.0", "job.shake.shakes=6"]


def test_the_summary_counts_reported_slips():
    session = run(None, [*QUICK, "job.backend=shake", "job.shake.still_s=0.3", "job.shake.shakes=1"])
    called = session.summary["called_slip"]
    assert 0 <= called["slip"] < called["answered"]
    assert 20 < called["answered"] < session.summary["cycles"]
    assert (called["lifted"], called["slipped_m"]) == (True, 0.0)


def test_calibrating_on_the_simulated_rig_writes_a_file_that_runs(tmp_path):
    out, written = tmp_path / "slip.toml", tmp_path / "result.json"
    flags = [part for each in (*QUICK, *FEW) for part in ("--set", each)]
    assert main(["calibrate", "slip", *flags, "--out", str(out), "--json", str(written)]) == 0
    summary = json.loads(written.read_text())
    names = [each["name"] for each in summary["detectors"]]
    assert names == ["fused", "imprint"]
    assert summary["moving"] > 40
    assert summary["still"] < 600, "options of [job.shake] count"
    assert summary["noise_before"]["gel_share"] > 0
    assert summary["slides"] == 1
    for each in summary["detectors"]:
        assert each["after"]["per_100_moving"] <= max(each["before"]["per_100_moving"], 8)
        assert each["after"]["noticed"] == 1, "a pipe that slides is noticed all the same"
    assert "gel_share" in tomllib.loads(out.read_text())["estimator"]["fused"]
    caught = run(None, [*QUICK, f'calibration=["{out}"]'])
    assert caught.summary["outcome"] == "held"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--out", "slip.json"], "must end in .toml"),
        (["--set", "arm.backend=none"], "add --by-hand"),
        (["--load", "nowhere.avi"], "nowhere.avi"),
        (["--detector", "imprnt"], "imprnt"),
        (["--by-hand", "--load", "a.avi"], "leave the recordings out"),
        (["--by-hand"], "--by-hand needs a real sensor"),
        (["--seconds", "5"], "--seconds is for --by-hand"),
        (["--load", "a.avi", "--firm-mm", "2"], "--firm-mm is for a simulated rig"),
        (["--by-hand", "--firm-mm", "2"], "--firm-mm is for a simulated rig"),
        (["--still", "a.avi"], "add --load RECORDING"),
        (["--still", "a.avi", "--slide", "b.avi"], "add --load RECORDING"),
        (["--slide", "a.avi"], "add --still RECORDING and --load RECORDING"),
        (["--load", "a.avi", "--still", "b/*.png"], "b/*.png, a.avi: no such"),
        ([str(EXAMPLES / "hardware.toml")], "only a simulated rig moves by itself"),
    ],
)
def test_what_cannot_be_calibrated_is_an_error(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    assert main(["calibrate", "slip", *arguments]) not in (0, 1)
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_by_hand_prints_each_instruction_after_the_untouched_gel_was_seen():
    printed, config = [], load_config()
    phases = watched_hand(config, by_hand(2.0), built(config, ["imprint"]), printed.append)
    asked = ["do not touch the gel", "put the object into the grip", "hold it still", "wriggle it:", "wriggle it ("]
    assert [line[: len(each)] for line, each in zip(printed, asked, strict=False)] == asked
    with pytest.raises(DataError, match="0 of 40 frames in which the gel moves"):  # Nobody has moved anything.
        calibrate_slip(phases)


@pytest.mark.parametrize("aperture_m", [0.0236, 0.03])
def test_an_object_that_slips_or_is_not_held_leaves_no_file(tmp_path, monkeypatch, capsys, aperture_m):
    monkeypatch.chdir(tmp_path)
    flags = [part for each in (*QUICK, *FEW, f"task.grip_aperture_m={aperture_m}") for part in ("--set", each)]
    assert main(["calibrate", "slip", *flags, "--firm-mm", "0"]) == DataError.exit_code
    printed = capsys.readouterr().err
    assert "gripped 0 mm closer than usual, the object slipped or was not held at all" in printed
    assert "a larger --firm-mm" in printed
    assert list(tmp_path.iterdir()) == []


def test_of_a_flag_and_the_config_s_own_option_the_flag_counts(monkeypatch):
    asked = []
    monkeypatch.setattr(sources, "_moved", lambda config, job, *_, **__: asked.append(job) or 0.0)
    printed = []
    for firm_mm in (None, 3.5):
        watched_rig(load_config(None, ["job.shake.closer_mm=1.5", "job.shake.shakes=2"]), firm_mm, {}, printed.append)
    shaken = [job.tables["shake"] for job in asked if job.backend == "shake"]
    assert [(each["closer_mm"], each["shakes"], each["still_s"]) for each in shaken] == [(1.5, 2, 8.0), (3.5, 2, 8.0)]
    assert printed[0].startswith("gripping 1.5 mm closer")
    assert "did not slide" in printed[2]


def test_a_config_may_name_the_file_before_there_is_one(tmp_path, capsys):
    rig, clip = tmp_path / "rig.toml", tmp_path / "clip.avi"
    rig.write_text('calibration = ["slip.toml"]\n[tactile]\nreference_frames = 1\n')
    write_video(clip, [render(pad_positions(), seed=seed) for seed in range(12)])
    main(["calibrate", "slip", str(rig), "--load", str(clip), "--out", str(tmp_path / "slip.toml")])
    assert "show too little" in capsys.readouterr().err


@pytest.mark.slow
def test_the_simulated_rig_shows_enough_to_lower_a_threshold(tmp_path):
    written = tmp_path / "result.json"
    assert main(["calibrate", "slip", "--out", str(tmp_path / "slip.toml"), "--json", str(written)]) == 0
    assert all(each["lowers"] for each in json.loads(written.read_text())["detectors"])


def test_a_threshold_of_the_config_s_own_is_pointed_out(tmp_path):
    rig, out, written = tmp_path / "rig.toml", tmp_path / "slip.toml", tmp_path / "result.json"
    rig.write_text("[detector.fused]\nthreshold = 0.9\n")
    flags = [part for each in (*QUICK, *FEW) for part in ("--set", each)]
    assert main(["calibrate", "slip", str(rig), *flags, "--out", str(out), "--json", str(written)]) == 0
    assert "the config sets detector.fused.threshold itself" in json.loads(written.read_text())["warnings"][0]
