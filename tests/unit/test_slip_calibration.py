"""Calibrating slip: thresholds within a budget of false alarms, the file, and the config that names it."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.calibration import sources
from lsds.calibration.file import as_toml, noise_in, outweighed
from lsds.calibration.noise import ImprintNoise, imprint_noise
from lsds.calibration.slip import calibrate_slip
from lsds.calibration.thresholds import Budget, exceeds, threshold
from lsds.calibration.watched import FIRST_FRAMES, WatchedPhase
from lsds.cli.calibrate_slip import print_result
from lsds.cli.main import main
from lsds.config import dump_config, load_config
from lsds.errors import ConfigError, DataError
from lsds.tactile.imprint.motion import ImprintMotion
from lsds.tactile.imprint.uncertainty import GEL_SHARE

scores = st.lists(st.floats(-5, 5, width=32) | st.just(math.nan), max_size=200).map(lambda x: np.array(x, float))
budgets = st.builds(Budget, st.floats(0, 50), st.floats(0, 50))


def allowed(moving, still, budget):
    return [
        (moving, math.floor(round(len(moving) * budget.moving / 100, 9))),
        (still, math.ceil(round(len(still) * budget.still / 100, 9))),
    ]


@given(scores, scores, budgets)
def test_no_more_frames_exceed_the_threshold_than_the_budget_allows(moving, still, budget):
    least = threshold(moving, still, budget)
    assert all(exceeds(part, least).sum() <= most for part, most in allowed(moving, still, budget))


@given(scores, scores, budgets)
def test_the_threshold_is_the_lowest_such_score(moving, still, budget):
    least = threshold(moving, still, budget)
    if math.isfinite(least):
        below = np.nextafter(least, -math.inf)
        assert any(exceeds(part, below).sum() > most for part, most in allowed(moving, still, budget))


def phase(name, kind, score, moved=1.0, threshold=0.5, motions=()):
    score = np.asarray(score, float)
    filler = np.zeros(FIRST_FRAMES)
    moved = np.broadcast_to(np.asarray(moved, float), score.shape)
    whole = np.concatenate([filler, score]).tolist()
    known = [None] * (len(whole) - len(motions)) + list(motions)
    return WatchedPhase(
        name, kind, np.concatenate([filler, moved]).tolist(), {"fused": whole}, {"fused": threshold}, known
    )


def cell(rng, load=0.7, slide=0.9):
    """A rig on which load changes score about `load` and slides about `slide`."""
    return [
        phase("rests", "still", rng.uniform(0, 0.1, 2000), moved=0.0),
        phase("wriggled", "load", np.clip(rng.normal(load, 0.05, 400), 0, 0.999)),
        phase("shaken", "load", np.clip(rng.normal(load, 0.05, 400), 0, 0.999)),
        phase("pulled", "slide", np.clip(rng.normal(slide, 0.02, 100), 0, 0.999)),
    ]


def test_a_threshold_that_calls_load_changes_slip_is_raised():
    result = calibrate_slip(cell(np.random.default_rng(0)))
    (found,) = result.detectors
    assert found.before.per_100_moving > 90
    assert found.after.per_100_moving == pytest.approx(5, abs=0.2)
    assert 0.7 < found.after.threshold < 0.85
    assert (found.after.found, found.after.noticed) == (1.0, 1)
    assert found.left_out[0] < 10
    assert (result.moving, result.still, result.slides, found.lowers) == (800, 2000, 1, True)


def test_a_threshold_is_lowered_only_where_enough_was_seen():
    quiet = cell(np.random.default_rng(0), load=0.2)
    assert calibrate_slip(quiet).detectors[0].after.threshold < 0.4
    few = [*quiet[:1], phase("wriggled", "load", [0.2] * 50), quiet[-1]]
    result = calibrate_slip(few)
    assert not result.detectors[0].lowers
    assert result.detectors[0].after.threshold == 0.5


def test_frames_in_which_it_abstains_do_not_count_as_quiet():
    abstains = [math.nan] * 395 + [0.9] * 5
    quiet = [
        phase("rests", "still", [0.02] * 2000, moved=0.0, threshold=0.85),
        phase("wriggled", "load", abstains, threshold=0.85),
    ]
    (found,) = calibrate_slip(quiet).detectors
    assert not found.lowers
    assert found.after.threshold >= 0.85


def test_a_detector_that_never_stirs_keeps_its_threshold():
    quiet = [phase("a", "still", [0.0] * 2000, moved=0.0), phase("b", "load", [0.0] * 400)]
    result = calibrate_slip(quiet)
    assert result.detectors[0].after.threshold == 0.5
    found = as_toml(result)
    assert "threshold = 0.5" in found.text, "written all the same: the file replaces an older one"
    assert found.problems == []


def test_an_abstaining_frame_raises_no_alarm():
    quiet = [
        phase("rests", "still", [0.0] * 100, moved=0.0),
        phase("wriggled", "load", [math.nan] * 90 + [0.1] * 10),
    ]
    assert calibrate_slip(quiet).detectors[0].after.per_100_moving == 0


@pytest.mark.parametrize(
    ("load", "still", "message"),
    [(10, 100, "10 of 40 frames in which the gel moves"), (100, 20, "20 of 50 frames in which it rests")],
)
def test_too_few_frames_are_an_error(load, still, message):
    quiet = [phase("a", "still", [0.0] * still, moved=0.0), phase("b", "load", [0.1] * load)]
    with pytest.raises(DataError, match=message):
        calibrate_slip(quiet)
    with pytest.raises(DataError, match="too little"):
        calibrate_slip([])


def motion(rng, dots_m, share, still_m):
    x, y, rim = (np.hypot(share * dots_m, still_m) * rng.standard_t(4, 3)).tolist()
    radius = 3e-3
    return ImprintMotion(
        (x, y), rim / radius, (dots_m, 0.0), dots_m, (0.0, 0.0), np.diag([1e14, 1e14, 1e14 * radius**2]), 0.98, 0.97,
        1.0, 1.0, 0.1, 1e-4, 1.0, radius,
    )  # fmt: skip


@pytest.mark.parametrize(("share", "still_m"), [(0.08, 1e-5), (0.35, 2e-5)])
def test_the_noise_is_estimated_from_sticking_frames(share, still_m):
    rng = np.random.default_rng(1)
    dots = np.concatenate([np.zeros(300), rng.uniform(1e-4, 5e-4, 400)])
    motions = [motion(rng, each, share, still_m) for each in dots]
    found = imprint_noise(motions)
    assert found.gel_share == pytest.approx(share, rel=0.35)
    assert found.still_m == pytest.approx(still_m, rel=0.45)
    assert imprint_noise(motions[:300]).gel_share == GEL_SHARE, "a gel at rest has no information on its share"
    assert imprint_noise(motions[:20]) is None
    assert imprint_noise([None] * 100) is None


def test_the_file_is_named_by_the_config_and_counts_below_its_own_options(tmp_path):
    result = calibrate_slip(cell(np.random.default_rng(0)))
    (tmp_path / "slip.toml").write_text(as_toml(result).text)
    learnt = tomllib.loads((tmp_path / "slip.toml").read_text())["detector"]["fused"]["threshold"]
    assert learnt >= result.detectors[0].after.threshold
    rig = tmp_path / "rig.toml"
    rig.write_text('calibration = ["slip.toml"]\n')
    config = load_config(rig)
    assert config.section("detector").options() == {"threshold": learnt}
    assert load_config(rig, ["detector.fused.threshold=0.7"]).section("detector").options() == {"threshold": 0.7}
    # Written out, a config stands without the file.
    alone = tmp_path / "alone.toml"
    alone.write_text(dump_config(config))
    assert load_config(alone).section("detector").options() == {"threshold": learnt}


def test_a_file_may_hold_parameters_of_gel_and_grip(tmp_path):
    (tmp_path / "grip.toml").write_text("[tactile]\nshear_kpa_mm = 30.0\n[grip]\nnoise = 0.05\n")
    rig = tmp_path / "rig.toml"
    rig.write_text('calibration = ["grip.toml"]\n[grip]\nkinetic = 1.1\n')
    config = load_config(rig)
    assert (config.tactile.shear_kpa_mm, config.grip.noise, config.grip.kinetic) == (30.0, 0.05, 1.1)


def test_of_two_files_the_later_counts_more(tmp_path):
    for name, value in (("a", 0.7), ("b", 0.8)):
        (tmp_path / f"{name}.toml").write_text(f"[detector.fused]\nthreshold = {value}\n")
    rig = tmp_path / "rig.toml"
    rig.write_text('calibration = ["a.toml", "b.toml"]\n')
    assert load_config(rig).section("detector").options() == {"threshold": 0.8}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[task]\nlift_s = 1.0\n", r"slip\.toml.*task: does not belong into a file of calibration"),
        ('[detector]\nbackend = "imprint"\n', "detector: holds something else than tables of options"),
        ("[detector.fused]\nthreshold = 3.0\n", r"slip\.toml.*detector\.fused\.threshold"),
        ("[detector.fusd]\nthreshold = 0.3\n", r"detector\.fusd: no installed backend has that name"),
        ("[detector.fused\n", r"slip\.toml.*line"),
    ],
)
def test_a_file_that_is_no_calibration_is_an_error_with_its_name(tmp_path, text, message):
    (tmp_path / "slip.toml").write_text(text)
    rig = tmp_path / "rig.toml"
    rig.write_text('calibration = ["slip.toml"]\n')
    with pytest.raises(ConfigError, match=f"(?s){message}"):
        load_config(rig)


def test_a_missing_file_and_a_wrong_list_are_errors(tmp_path):
    with pytest.raises(ConfigError, match=r"(?s)none\.toml.*does not exist"):
        load_config(None, ['calibration=["none.toml"]'])
    with pytest.raises(ConfigError, match=r"calibration: should be a list, got 3"):
        load_config(None, ["calibration=3"])
    with pytest.raises(ConfigError, match=r'should be a list, got \'slip.toml\' \(calibration = \["slip.toml"\]\)'):
        load_config(None, ["calibration=slip.toml"])


def test_missing_files_are_an_error_with_the_config_and_the_folder(tmp_path):
    rig = tmp_path / "rig.toml"
    rig.write_text('calibration = ["a.toml", "deep/b.toml"]\n')
    with pytest.raises(ConfigError) as raised:
        load_config(rig)
    assert raised.value.source == str(rig)
    assert [issue.problem for issue in raised.value.issues] == [
        f"a.toml does not exist in the folder {tmp_path}",
        f"b.toml does not exist in the folder {tmp_path / 'deep'}",
    ]
    assert "schema --example" not in str(raised.value)


def test_certainty_where_nothing_slips_cannot_be_calibrated_away():
    certain = [phase("a", "still", [0.0] * 100, moved=0.0), phase("b", "load", [1.0] * 100)]
    found = as_toml(calibrate_slip(certain))
    assert found.tables == {}
    assert "reports slip with certainty in frames without slip" in found.problems[0]


def test_a_threshold_at_which_the_slides_are_lost_is_not_written():
    slips = cell(np.random.default_rng(0), load=0.95, slide=0.6)
    sticks = [motion(np.random.default_rng(1), 3e-4, 0.2, 1e-5) for _ in range(400)]
    slips[1].motions[-400:] = sticks
    result = calibrate_slip(slips)
    assert result.noise is not None
    found = as_toml(result)
    assert found.tables == {}, "nor is the noise: the object may have slipped"
    assert "finds 0% of the sliding frames, before 100%" in found.problems[0]
    assert "did the object slip" in found.problems[0]


def test_where_nothing_can_be_calibrated_no_file_is_left(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    phases = cell(np.random.default_rng(0), load=0.95, slide=0.6)
    flags = []
    for each in phases:
        (tmp_path / each.name).touch()
        flags += [f"--{each.phase}", each.name]
    monkeypatch.setattr(sources, "watched_recording", lambda *_: phases.pop(0))
    assert main(["calibrate", "slip", "--detector", "fused", *flags]) == DataError.exit_code
    printed = capsys.readouterr()
    assert "fused, unwritten" in printed.out
    assert "nothing could be calibrated, and no file is written: detector 'fused'" in printed.err
    assert not (tmp_path / "slip.toml").exists()


def test_without_a_slide_nothing_is_lost():
    quiet = cell(np.random.default_rng(0), load=0.95)[:-1]
    assert "fused" in as_toml(calibrate_slip(quiet)).tables["detector"]


def test_noise_outside_the_searched_range_is_not_written():
    rng = np.random.default_rng(1)
    phases = cell(rng)
    phases[1].motions[-400:] = [motion(rng, 4e-4, 1.5, 1e-5) for _ in range(400)]
    found = as_toml(calibrate_slip(phases))
    assert list(found.tables) == ["detector"]
    assert "60% of the markers' motion" in found.problems[0]


def test_how_many_frames_were_answered_is_counted():
    quiet = [
        phase("rests", "still", [0.02] * 1500, moved=0.0),
        phase("wriggled", "load", [math.nan] * 30 + [0.1] * 50),
    ]
    assert calibrate_slip(quiet).detectors[0].answered == (50, 1500)


def test_the_noise_before_is_that_of_the_config_s_estimator():
    assert noise_in(load_config()) == pytest.approx(ImprintNoise(), rel=0.01)
    assert noise_in(load_config(None, ["estimator.fused.gel_share=0.4"])).gel_share == 0.4
    assert noise_in(load_config(None, ["estimator.backend=field"])) is None


def test_options_of_the_config_s_own_are_pointed_out():
    config = load_config(None, ["detector.fused.threshold=0.9", "estimator.imprint.gel_share=0.4"])
    tables = {"detector": {"fused": {"threshold": 0.8}}, "estimator": {"imprint": {"gel_share": 0.1, "still_um": 3.0}}}
    assert [each.split(" itself")[0] for each in outweighed(tables, config)] == [
        "the config sets detector.fused.threshold",
        "the config sets estimator.imprint.gel_share",
    ]


def test_a_detector_without_a_threshold_is_marked_and_not_advised(capsys):
    quiet = [
        phase("a", "still", [0.0] * 100, moved=0.0),
        phase("b", "load", [0.1] * 45 + [0.9] * 5),
        phase("c", "slide", [0.95] * 50),
    ]
    result = calibrate_slip(quiet)
    (each,) = result.detectors
    detectors = (each, replace(each, name="monotone"))
    print_result(replace(result, detectors=detectors), {"detector": {"fused": {"threshold": 0.5}}}, None)
    printed = capsys.readouterr()
    assert "fused, after" in printed.out
    assert "monotone, unwritten" in printed.out
    assert printed.err == (
        "fused answered in 50 of 50 moving and 100 of 100 still frames; lowering its threshold takes 100 and 1000: "
        "record for longer\n"
    )


# -- other objects --------------------------------------------------------------------------------------------


def objects(levels, seed=0):
    """Return a recording of changing load for each object, with scores around a different level for each."""
    rng = np.random.default_rng(seed)
    rest = phase("rests", "still", rng.uniform(0, 0.1, 2000), moved=0.0)
    loads = [phase(f"o{k}", "load", np.clip(rng.normal(level, 0.08, 400), 0, 0.999)) for k, level in enumerate(levels)]
    return [rest, *loads, phase("pulled", "slide", np.clip(rng.normal(0.95, 0.02, 100), 0, 0.999))]


def test_objects_that_differ_get_a_threshold_that_others_keep_to():
    (alike,) = calibrate_slip(objects([0.5] * 6)).detectors
    (unlike,) = calibrate_slip(objects([0.3, 0.4, 0.5, 0.55, 0.6, 0.65])).detectors
    assert alike.share == 1.0
    assert unlike.share < 1.0
    assert unlike.after.per_100_moving < 5.0
    assert unlike.left_out[0] <= 5.0


def test_the_expected_rate_on_other_objects_holds_on_average():
    """Calibrated on five objects and tried on five others of the same kind, many times."""
    rates = []
    for seed in range(40):
        levels = np.random.default_rng(seed).normal(0.5, 0.07, 10)
        (found,) = calibrate_slip(objects(levels[:5], seed)).detectors
        fresh = [own.score("fused") for own in objects(levels[5:], seed + 1000) if own.phase == "load"]
        rates.append(100 * np.mean([exceeds(score, found.after.threshold).mean() for score in fresh]))
    assert np.mean(rates) < 7.0


def test_fewer_than_three_objects_promise_nothing(capsys):
    result = calibrate_slip(objects([0.5, 0.6]))
    assert not result.transfers
    print_result(result, {"detector": {"fused": {}}}, None)
    assert "the false alarms on a new object are unknown" in capsys.readouterr().out
