"""Calibrating slip: thresholds within a budget of false alarms, the file, and the config that names it."""

from __future__ import annotations

import math
import tomllib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.calibration.file import as_toml
from lsds.calibration.noise import imprint_noise
from lsds.calibration.slip import calibrate_slip
from lsds.calibration.thresholds import Budget, exceeds, threshold
from lsds.calibration.watched import FIRST_FRAMES, WatchedPhase
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
    text, problems = as_toml(result)
    assert "threshold = 0.5" in text, "written all the same: the file replaces an older one"
    assert problems == []


def test_an_abstaining_frame_raises_no_alarm():
    quiet = [
        phase("rests", "still", [0.0] * 100, moved=0.0),
        phase("wriggled", "load", [math.nan] * 90 + [0.1] * 10),
    ]
    assert calibrate_slip(quiet).detectors[0].after.per_100_moving == 0


@pytest.mark.parametrize(
    ("load", "still", "says"),
    [(10, 100, "10 of 40 frames in which the gel moves"), (100, 20, "20 of 50 frames in which it rests")],
)
def test_too_little_to_learn_from_is_said(load, still, says):
    quiet = [phase("a", "still", [0.0] * still, moved=0.0), phase("b", "load", [0.1] * load)]
    with pytest.raises(DataError, match=says):
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
def test_the_noise_is_learnt_from_what_sticks(share, still_m):
    rng = np.random.default_rng(1)
    dots = np.concatenate([np.zeros(300), rng.uniform(1e-4, 5e-4, 400)])
    motions = [motion(rng, each, share, still_m) for each in dots]
    found = imprint_noise(motions)
    assert found.gel_share == pytest.approx(share, rel=0.35)
    assert found.still_m == pytest.approx(still_m, rel=0.45)
    assert imprint_noise(motions[:300]).gel_share == GEL_SHARE, "of a gel at rest its share tells nothing"
    assert imprint_noise(motions[:20]) is None
    assert imprint_noise([None] * 100) is None


def test_the_file_is_named_by_the_config_and_counts_below_its_own_options(tmp_path):
    result = calibrate_slip(cell(np.random.default_rng(0)))
    (tmp_path / "slip.toml").write_text(as_toml(result)[0])
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


def test_of_two_files_the_later_counts_more(tmp_path):
    for name, value in (("a", 0.7), ("b", 0.8)):
        (tmp_path / f"{name}.toml").write_text(f"[detector.fused]\nthreshold = {value}\n")
    rig = tmp_path / "rig.toml"
    rig.write_text('calibration = ["a.toml", "b.toml"]\n')
    assert load_config(rig).section("detector").options() == {"threshold": 0.8}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[task]\nlift_s = 1.0\n", r"slip\.toml.*task: does not belong into a file of calibration"),
        ('[detector]\nbackend = "imprint"\n', "detector: holds something else than tables of options"),
        ("[detector.fused]\nthreshold = 3.0\n", r"slip\.toml.*detector\.fused\.threshold"),
        ("[detector.fusd]\nthreshold = 0.3\n", r"detector\.fusd: no installed backend has that name"),
        ("[detector.fused\n", r"slip\.toml.*line"),
    ],
)
def test_a_file_that_is_none_is_said_by_its_own_name(tmp_path, text, says):
    (tmp_path / "slip.toml").write_text(text)
    rig = tmp_path / "rig.toml"
    rig.write_text('calibration = ["slip.toml"]\n')
    with pytest.raises(ConfigError, match=f"(?s){says}"):
        load_config(rig)


def test_a_missing_file_and_a_wrong_list_are_said(tmp_path):
    with pytest.raises(ConfigError, match=r"(?s)none\.toml.*does not exist"):
        load_config(None, ['calibration=["none.toml"]'])
    with pytest.raises(ConfigError, match="calibration"):
        load_config(None, ["calibration=3"])


def test_certainty_where_nothing_slips_cannot_be_calibrated_away():
    certain = [phase("a", "still", [0.0] * 100, moved=0.0), phase("b", "load", [1.0] * 100)]
    text, problems = as_toml(calibrate_slip(certain))
    assert "threshold" not in tomllib.loads(text).get("detector", {})
    assert "calls slip with certainty where nothing slips" in problems[0]
