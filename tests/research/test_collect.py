"""Collecting: protocols are reproducible by seed, recordings survive failures, labels are measured."""

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from lsds_mocks.devices.ur5e import MockUR5e
from lsds_research.collecting import campaign
from lsds_research.collecting.drive import run_trial
from lsds_research.collecting.labels import SlipLabels
from lsds_research.collecting.objects import FORCES_N, PIPE, PLANS, SEEN, UNSEEN
from lsds_research.collecting.trials import SPEEDS_M_S, STUDY, trials
from lsds_research.datasets import COLUMNS, load, read_table

from lsds.calibration.vision.rotation import pose_of
from lsds.contracts import CellTruth, GripperState, Pose, PoseSample
from lsds.errors import DataError, MissingExtra, SafetyStop
from lsds.session.run import run

FAST = ("pose_source.backend=none",)
_done = {}


def recorded(trial, config_file, overrides, record=None):
    """`run_trial` on the simulated cell, each trial once: for tests of how recordings are kept, not what they hold."""
    if trial.recording not in _done:
        _done[trial.recording] = run_trial(trial, None, FAST)
    return _done[trial.recording]


@pytest.fixture
def trial_recorded(monkeypatch):
    monkeypatch.setattr(campaign, "run_trial", recorded)


def test_the_objects_are_the_study_s():
    assert (len(SEEN), len(UNSEEN)) == (15, 5)
    assert set(PLANS) == {*SEEN, *UNSEEN, PIPE}


def test_plans_agree_with_the_simulated_catalogue():
    from lsds_mocks.objects.catalogue import CATALOGUE

    for name, plan in PLANS.items():
        spec = CATALOGUE[name]
        assert (plan.thickness_mm, plan.length_mm) == (spec.diameter_mm, spec.length_mm)
        assert plan.needed_n == pytest.approx(spec.mass_kg * 9.81 / (2 * spec.static_friction), rel=0.02)


@pytest.mark.parametrize("name", PLANS)
def test_force_and_aperture_are_each_other_s_inverse(name):
    plan = PLANS[name]
    for force, closure in zip(FORCES_N, plan.closure_mm, strict=True):
        assert plan.aperture_m(force) == pytest.approx((plan.thickness_mm - closure) * 1e-3)
    for force in (0.2, 1.0, 2.0, 5.0, 8.9):
        assert plan.force_n(plan.aperture_m(force)) == pytest.approx(force)
    assert plan.force_n(plan.thickness_mm * 1e-3) == 0


@pytest.mark.parametrize("job", [*STUDY, "catch", "loads"])
def test_trials_are_the_same_by_seed_and_within_the_cell_s_limits(job):
    planned = trials(job, None, 3)
    assert planned == trials(job, None, 3)
    assert planned != trials(job, None, 4)
    names = [trial.recording for trial in planned]
    assert len(set(names)) == len(names)
    for trial in planned:
        assert all(0 < move.duration_s < 10 and abs(move.velocity_m_s) <= 0.1 for move in trial.moves)
        assert 0 <= trial.grip_aperture_m < PLANS[trial.object].thickness_mm * 1e-3
        height = np.cumsum([move.duration_s * move.velocity_m_s for move in trial.moves])
        assert trial.clamped or height.min() > -1e-6


def test_the_protocols_have_what_the_study_s_have():
    severity = [trial for trial in trials("severity", ["can"], 0) if trial.protocol == "severity"]
    speeds = [max(move.velocity_m_s for move in trial.moves) for trial in severity]
    assert sorted(set(speeds)) == list(SPEEDS_M_S)
    assert all(speeds.count(speed) == 5 for speed in SPEEDS_M_S)
    detection = trials("detection", ["can"], 0)
    static = [trial for trial in detection if trial.protocol == "static"]
    assert len(static) == 5
    apertures = [trial.grip_aperture_m for trial in static]
    assert apertures == sorted(apertures, reverse=True)
    (grasp,) = [trial for trial in detection if trial.protocol == "grasp"]
    steps = [move.aperture_m for move in grasp.moves if move.aperture_m is not None]
    assert np.diff(steps) == pytest.approx(-50e-3 / 230)
    assert [move.duration_s for move in grasp.moves[1:]] == [5.0] * 10


def test_a_catch_closes_while_the_arm_moves_and_never_opens():
    planned = trials("catch", None, 0)
    assert {trial.clamped for trial in planned} == {False, True}
    for trial in planned:
        closing = [move for move in trial.moves if move.aperture_m is not None]
        apertures = [trial.grip_aperture_m, *(move.aperture_m for move in closing)]
        assert closing
        assert np.all(np.diff(apertures) <= 0)
        assert all(move.velocity_m_s > 0 and 0.02 <= move.closing_m_s <= 0.15 for move in closing)
        assert trial.moves[-1].velocity_m_s == 0, "it ends at rest"


def test_an_object_without_a_plan_is_named():
    with pytest.raises(DataError, match="no plan for brick"):
        trials("severity", ["brick"], 0)


def test_collects_and_goes_on_where_it_stopped(tmp_path, monkeypatch):
    out, seen = tmp_path / "pipe", []
    real = campaign.run_trial

    def third_fails(trial, config_file, overrides, record=None):
        seen.append(trial.recording)
        if len(seen) == 2:
            raise KeyboardInterrupt
        return real(trial, config_file, overrides)

    monkeypatch.setattr(campaign, "run_trial", third_fails)
    with pytest.raises(KeyboardInterrupt):
        campaign.collect("pipe", out, overrides=FAST, quick=True)
    assert len(list((out / "parts").iterdir())) == 1
    with pytest.raises(DataError, match="not finished"):
        load(out)
    with pytest.raises(DataError, match="started with another seed"):
        campaign.collect("pipe", out, overrides=FAST, quick=True, seed=1)
    data = campaign.collect("pipe", out, overrides=FAST, quick=True)
    assert len(seen) == 3
    assert set(data["recording"]) == {trial.recording for trial in trials("pipe", None, 0, quick=True)}
    assert not (out / "parts").exists()
    again = load(out)
    assert list(again.columns) == list(COLUMNS)
    for name in COLUMNS:
        assert np.array_equal(again[name], data[name], equal_nan=COLUMNS[name] != "str")
    assert again.card["figures_are"] == "simulated"
    assert again.card["gels"]
    with pytest.raises(DataError, match=r"holds a complete dataset with another seed \(0\)"):
        campaign.collect("pipe", out, overrides=FAST, quick=True, seed=1)
    slipping = again["speed_true"] > 1e-3
    assert again["speed_true"][slipping] == pytest.approx(0.038, abs=0.004)
    assert 0.05 < slipping.mean() < 0.6
    # Smoothed and lagging, but the same slip.
    assert (again["slip"][slipping] == 1).mean() > 0.7
    with pytest.raises(DataError, match="this dataset, complete: nothing is left"):
        campaign.collect("pipe", out, overrides=FAST, quick=True)


@pytest.mark.usefixtures("trial_recorded")
def test_a_full_disk_loses_nothing(tmp_path, monkeypatch):
    out = tmp_path / "pipe"
    written = []
    real = campaign.write_table

    def full(columns, path):
        if written:
            raise DataError(f"{path}: cannot be written: No space left on device")
        written.append(path)
        real(columns, path)

    monkeypatch.setattr(campaign, "write_table", full)
    with pytest.raises(DataError, match="No space left"):
        campaign.collect("pipe", out, overrides=FAST, quick=True)
    assert len(read_table(written[0])["frame"]) > 10
    monkeypatch.setattr(campaign, "write_table", real)
    campaign.collect("pipe", out, overrides=FAST, quick=True)
    assert load(out).card["complete"]


def first_fails(error):
    """`run_trial` that raises an error in a job's first recording."""

    def run(trial, config_file, overrides, record=None):
        if trial.recording.endswith("__0"):
            raise error
        return recorded(trial, config_file, overrides)

    return run


def test_a_trial_that_meets_a_library_s_error_is_named_and_the_others_are_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(campaign, "run_trial", first_fails(ValueError("matrix is singular")))
    with pytest.raises(DataError, match=r"1 of 2 recordings failed[^\0]*ValueError: matrix is singular"):
        campaign.collect("pipe", tmp_path / "pipe", overrides=FAST, quick=True)
    (kept,) = (tmp_path / "pipe" / "parts").iterdir()
    kept.write_bytes(kept.read_bytes()[:100])
    monkeypatch.setattr(campaign, "run_trial", recorded)
    data = campaign.collect("pipe", tmp_path / "pipe", overrides=FAST, quick=True)
    assert len(set(data["recording"])) == 2, "what was damaged is done again"


def test_a_simulated_trial_that_the_guard_stops_is_left_out_and_named_on_the_card(tmp_path, monkeypatch):
    monkeypatch.setattr(campaign, "run_trial", first_fails(SafetyStop("nothing usable for 1.01 s")))
    data = campaign.collect("pipe", tmp_path / "pipe", overrides=FAST, quick=True)
    (name,) = data.card["stopped"]
    assert name.endswith("__0")
    assert data.card["stopped"][name] == "nothing usable for 1.01 s"
    assert name not in data["recording"]
    assert load(tmp_path / "pipe").card["stopped"] == data.card["stopped"]


def test_a_dataset_of_which_every_trial_was_stopped_is_an_error(tmp_path, monkeypatch):
    def stops(trial, config_file, overrides, record=None):
        raise SafetyStop("nothing usable for 1.01 s")

    monkeypatch.setattr(campaign, "run_trial", stops)
    with pytest.raises(DataError, match=r"stopped every recording; the first: nothing usable for 1\.01 s"):
        campaign.collect("pipe", tmp_path / "pipe", overrides=FAST, quick=True)


@pytest.mark.parametrize("override", ["seed=3", "cell.simulated.object=sponge", "sensor.mock-gelsight-mini.gel=2"])
def test_what_a_trial_is_cannot_be_overridden(tmp_path, override):
    with pytest.raises(DataError, match="is set by the protocol"):
        campaign.collect("pipe", tmp_path / "pipe", overrides=(*FAST, override), quick=True)
    assert not (tmp_path / "pipe").exists()


@pytest.fixture
def begun(tmp_path, monkeypatch):
    """A campaign that was interrupted, its recording damaged since."""
    monkeypatch.setattr(campaign, "run_trial", first_fails(DataError("the light flickers")))
    with pytest.raises(DataError, match=r"1 of 2 recordings failed[^\0]*light flickers"):
        campaign.collect("pipe", tmp_path / "pipe", overrides=FAST, quick=True)
    (kept,) = (tmp_path / "pipe" / "parts").iterdir()
    kept.write_bytes(kept.read_bytes()[:100])
    return kept


def test_who_asks_for_something_else_moves_nothing_of_a_campaign_that_was_begun(begun):
    with pytest.raises(DataError, match=r"started with another seed \(0\)"):
        campaign.collect("pipe", begun.parents[1], overrides=FAST, quick=True, seed=1)
    assert [path.name for path in begun.parent.iterdir()] == [begun.name]


def test_without_pyarrow_no_recording_passes_for_damaged(begun, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingExtra, match=r"needs pyarrow, .* pip install 'lsds-tactile\[data\]'"):
        campaign.collect("pipe", begun.parents[1], overrides=FAST, quick=True)
    assert [path.name for path in begun.parent.iterdir()] == [begun.name]


def test_each_trial_leaves_a_recording_that_replays_and_the_dataset_stays_the_same(tmp_path):
    pytest.importorskip("mcap", reason="recordings need the extra record")
    from lsds.session.recording.reader import Recording
    from lsds.session.replay import replay

    folder = tmp_path / "runs"
    folder.mkdir()
    planned = trials("pipe", None, 0, quick=True)
    taken = folder / f"{planned[0].recording}.mcap"
    taken.write_bytes(b"of a trial that failed")
    data = campaign.collect("pipe", tmp_path / "pipe", overrides=FAST, quick=True, record=folder)
    assert taken.read_bytes() == b"of a trial that failed"
    kept = [folder / f"{planned[0].recording}-2.mcap", *(folder / f"{own.recording}.mcap" for own in planned[1:])]
    assert sorted(folder.iterdir()) == sorted([*kept, taken])
    for trial, path in zip(planned, kept, strict=True):
        assert replay(path).identical
        read = {frame.seq for _, frame in Recording(path).frames()}
        assert set(data["frame"][data["recording"] == trial.recording].tolist()) <= read
        for name, values in run_trial(trial, None, (*campaign.PRESETS["pipe"], *FAST)).items():
            own = data[name][data["recording"] == trial.recording]
            assert np.array_equal(own, values, equal_nan=COLUMNS[name] != "str")


def test_a_disk_that_is_full_for_the_recording_fails_the_trial_with_the_remedy(tmp_path, monkeypatch):
    pytest.importorskip("mcap", reason="recordings need the extra record")
    from lsds.session.recording.writer import RecordingWriter

    def full(self, event):
        raise DataError("no space left on device")

    monkeypatch.setattr(RecordingWriter, "observe", full)
    with pytest.raises(DataError, match=r"no space left on device.*or collect without --record"):
        campaign.collect("pipe", tmp_path / "pipe", overrides=FAST, quick=True, record=tmp_path / "runs")
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="recordings cannot be written"):
        campaign.collect("pipe", tmp_path / "other", overrides=FAST, quick=True, record=tmp_path / "file" / "runs")


def test_a_folder_that_is_something_else_is_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("\\section{}")
    with pytest.raises(DataError, match="not empty"):
        campaign.collect("pipe", tmp_path, quick=True)
    assert json.dumps([path.name for path in tmp_path.iterdir()]) == '["thesis.tex"]'


def truth(t_ns, slip):
    return CellTruth(t_ns, (0.0, slip), (0.0, slip), 0.0, 0.0, 0.0, 2.0, 1.0, 1.0, 0.02, 0.0, False, False)


class Samples:
    def __init__(self, samples):
        self.samples = samples


def test_labels_lag_as_a_pose_source_s_do():
    tick = 8_000_000
    log = Samples([truth(k * tick, 0.04 if 50 <= k < 100 else 0.0) for k in range(150)])
    labels = SlipLabels(log, measured=False)
    times = [k * tick for k in range(150)]
    found = labels.at(times)
    assert np.array_equal(found["slip_true"], [1 if 50 <= k < 100 else 0 for k in range(150)])
    onset, end = np.flatnonzero(np.diff(found["slip"]))
    assert 49 <= onset <= 51
    # It decays below 3 mm/s with a time constant of 30 ms.
    assert end - 99 == pytest.approx(0.03 * math.log(0.04 / 0.003) / 0.008, abs=2)


def test_labels_come_from_poses_where_there_are_any():
    tick = 16_000_000
    log = Samples([truth(k * tick, 0.02) for k in range(40)])
    labels = SlipLabels(log, measured=True)
    for k in range(40):
        gripper = Pose((0.0, 0.0, 0.5 + 0.03 * k * tick * 1e-9))
        labels.see(PoseSample(k * tick, k, {"gripper": gripper, "object": Pose((0.0, 0.0, 0.4))}))
    found = labels.at([k * tick for k in range(5, 40)])
    assert found["velocity_y"] == pytest.approx(0.03)
    assert found["speed_true"] == pytest.approx(0.02)
    assert found["angular_velocity_label"] == pytest.approx(0.0), "the simulated camera is not shown that it turns"
    unseen = SlipLabels(log, measured=True).at([10 * tick])
    assert unseen["slip"][0] == -1
    assert math.isnan(unseen["speed"][0])


def test_without_truth_poses_give_the_turn_beyond_half_a_turn():
    tick, rate = 16_000_000, -4.0
    labels = SlipLabels(Samples([]), measured=True)
    facing = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    for k in range(120):
        angle = rate * k * tick * 1e-9
        turn = np.array([[math.cos(angle), 0, math.sin(angle)], [0, 1, 0], [-math.sin(angle), 0, math.cos(angle)]])
        # The pads stay where they are, and the object's origin lies next to and below them.
        gripper = pose_of(turn @ facing, np.array([0.0, 0.0, 0.5]))
        thing = pose_of(facing, np.array([0.03, -0.01, 0.4]))
        labels.see(PoseSample(k * tick, k, {"gripper": gripper, "object": thing}))
    found = labels.at([k * tick for k in range(10, 120)])
    assert found["angular_velocity_label"] == pytest.approx(rate)
    for name in ("velocity_x", "velocity_y"):
        assert np.abs(found[name]).max() < 1e-3, "turning about the pads is no sliding"
    assert found["slip"].tolist() == [1] * 110
    assert np.isnan(found["speed_true"]).all()
    assert set(found["slip_true"]) == {-1}


def test_beyond_the_object_s_end_poses_alone_do_not_show_slip():
    tick = 16_000_000
    labels = SlipLabels(Samples([]), measured=True, end_m=0.02)
    facing = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    for k in range(120):
        # At 3.8 cm/s past the end, then at rest.
        gripper = pose_of(facing, np.array([0.0, 0.0, 0.5 + 0.038 * min(k * tick * 1e-9, 1.0)]))
        labels.see(PoseSample(k * tick, k, {"gripper": gripper, "object": pose_of(facing, np.array([0.0, 0.0, 0.4]))}))
    found = labels.at([k * tick for k in range(20, 120)])
    slip = found["slip"]
    risen = 0.038 * np.minimum(np.arange(20, 120) * tick * 1e-9, 1.0)
    assert set(slip[risen < 0.018]) == {1}
    assert set(slip[(risen > 0.022) & (risen < 0.037)]) == {-1}
    assert np.isnan(found["speed"][slip == -1]).all()
    assert slip[-1] == 0


def test_a_real_cell_waits_until_the_operator_has_placed_the_object(tmp_path, monkeypatch):
    """A rig without a cell's plugin is a real one; here its trials are the simulated cell's."""
    real = (*campaign.PRESETS["pipe"], *FAST, "cell.backend=none")
    monkeypatch.setattr(campaign, "run_trial", recorded)
    with pytest.raises(DataError, match="an operator must place each object"):
        campaign.collect("pipe", tmp_path / "a", overrides=real, quick=True)
    assert not (tmp_path / "a").exists()
    asked = []
    data = campaign.collect("pipe", tmp_path / "b", overrides=real, quick=True, prepare=asked.append)
    assert [trial.recording for trial in asked] == list(dict.fromkeys(data["recording"].tolist()))
    assert data.card["figures_are"] == "measured"
    assert "gels" not in data.card, "these are simulated numbers"


def test_a_mock_on_the_wire_is_simulated(tmp_path, monkeypatch):
    monkeypatch.setattr(campaign, "run_trial", recorded)
    rig = Path(__file__).parents[2] / "examples" / "rigs" / "wire.toml"
    data = campaign.collect("pipe", tmp_path / "out", config_file=str(rig), quick=True)
    assert data.card["figures_are"] == "simulated"


def test_fingers_that_are_closed_are_no_beginning(monkeypatch):
    def closed(gripper):
        return GripperState(gripper._clock.now(), 0, 0.01, 0.01, moving=False)

    monkeypatch.setattr("lsds_mocks.devices.hand_e.MockHandE.read", closed)
    with pytest.raises(DataError, match="start at least"):
        run_trial(trials("pipe", None, 0, quick=True)[0], None, FAST)


@pytest.mark.parametrize("text", ["[]", "3", "{"])
def test_a_card_that_is_none_is_one_clear_error(tmp_path, text):
    (tmp_path / "card.json").write_text(text)
    with pytest.raises(DataError, match="not a dataset's card"):
        campaign.collect("pipe", tmp_path, overrides=FAST, quick=True)


def test_a_campaign_goes_on_with_the_same_cell_only(tmp_path, monkeypatch):
    rig = tmp_path / "rig.toml"
    rig.write_text("[task]\ngrip_force_n = 20.0\n")
    monkeypatch.setattr(campaign, "spread", lambda work, items, jobs: iter([(items[0], "stop")]))
    with pytest.raises(DataError, match="stop"):
        campaign.collect("pipe", tmp_path / "out", config_file=str(rig), quick=True)
    rig.write_text("[task]\ngrip_force_n = 30.0\n")
    with pytest.raises(DataError, match="started with another config"):
        campaign.collect("pipe", tmp_path / "out", config_file=str(rig), quick=True)


def test_a_dead_sensor_ends_a_trial_and_no_arm_runs_on(monkeypatch):
    """The arm used to go on for seconds, and the trial "ended normally"."""
    sent, command = [], MockUR5e.command

    def commanding(arm, asked):
        sent.append((arm._clock.now() / 1e9, any(asked.twist.linear_m_s)))
        return command(arm, asked)

    monkeypatch.setattr(MockUR5e, "command", commanding)
    silent = ("sensor.mock-gelsight-mini.silent_at_s=2.6", "cell.simulated.fidelity=winkler")
    trial = next(t for t in trials("severity", ["can"], 0) if t.protocol == "severity")
    with pytest.raises(SafetyStop, match="sensor: nothing usable"):
        run_trial(trial, None, (*FAST, *silent))
    assert any(moving for t_s, moving in sent if t_s < 2.6), "it fell silent while the arm moved"
    assert not any(moving for t_s, moving in sent if t_s > 2.6 + 0.3)


def test_a_trial_is_a_job_that_a_config_can_name():
    session = run(
        overrides=[
            "job.backend=trial",
            "job.trial.number=1",
            "cell.simulated.fidelity=winkler",
            "cell.simulated.clamped=true",
            "safety.max_arm_angular_rad_s=3.0",
        ]
    )
    assert session.fault is None
    assert session.summary["backends"]["job"] == "trial"
    assert session.summary["corrections"] == 0
