"""Groups are never shared; scores are those of their definitions and of scikit-learn."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lsds_research import metrics
from lsds_research.splits import folds, leave_one_out, random_folds
from sklearn import metrics as sk

from lsds.errors import DataError

seeds = st.integers(0, 10_000)


@settings(max_examples=50)
@given(seeds, st.integers(2, 5), st.integers(0, 8))
def test_every_row_is_tested_once_and_no_group_is_on_both_sides(seed, count, more):
    rng = np.random.default_rng(seed)
    sizes = rng.integers(1, 30, count + more)
    groups = np.repeat([f"g{i}" for i in range(len(sizes))], sizes).astype(object)
    slip = rng.random(len(groups)) < 0.45
    tested = np.zeros(len(groups), int)
    for train, test in folds(groups, slip, count, seed):
        assert not set(groups[train]) & set(groups[test])
        assert len(train) + len(test) == len(groups)
        assert len(test), "no fold is empty"
        tested[test] += 1
    assert (tested == 1).all()


def test_folds_get_alike_many_of_each_label():
    rng = np.random.default_rng(0)
    groups = np.repeat(np.arange(60), 20)
    slip = np.repeat(rng.random(60) < 0.4, 20)
    shares = [slip[test].mean() for _, test in folds(groups, slip, 5, 0)]
    sizes = [len(test) for _, test in folds(groups, slip, 5, 0)]
    assert max(shares) - min(shares) < 0.12
    assert max(sizes) - min(sizes) <= 60
    assert [test.tolist() for _, test in folds(groups, slip, 5, 1)] != [
        test.tolist() for _, test in folds(groups, slip, 5, 2)
    ]


def test_fewer_groups_than_folds_is_one_clear_error():
    with pytest.raises(DataError, match="3 folds need as many groups, there are 2: a, b"):
        list(folds(np.array(["a", "b", "b"], object), np.zeros(3), 3, 0))


def test_random_folds_leak_on_purpose_and_are_stratified():
    slip = np.arange(103) % 3 == 0
    tested = np.concatenate([test for _, test in random_folds(slip, 5, 0)])
    assert sorted(tested) == list(range(103))
    for train, test in random_folds(slip, 5, 0):
        assert not set(train) & set(test)
        assert abs(slip[test].mean() - slip.mean()) < 0.06


def test_leaving_one_out():
    groups = np.array(["b", "a", "b", "c"], object)
    assert [(n, tr.tolist(), te.tolist()) for n, tr, te in leave_one_out(groups)] == [
        ("a", [0, 2, 3], [1]),
        ("b", [1, 3], [0, 2]),
        ("c", [0, 1, 2], [3]),
    ]


@given(seeds, st.integers(2, 200), st.booleans())
def test_the_auc_is_scikit_learns(seed, count, ties):
    rng = np.random.default_rng(seed)
    slip = np.r_[True, False, rng.random(count) < 0.4]
    score = rng.standard_normal(count + 2) + slip
    if ties:
        score = np.round(score)
    assert metrics.auc(slip, score) == pytest.approx(sk.roc_auc_score(slip, score), abs=1e-12)
    assert math.isnan(metrics.auc(np.ones(3, bool), np.arange(3.0)))


@given(seeds, st.integers(5, 200))
def test_the_scores_of_a_detector_are_scikit_learns(seed, count):
    rng = np.random.default_rng(seed)
    slip, predicted = np.r_[True, False, rng.random(count) < 0.4], np.r_[True, True, rng.random(count) < 0.5]
    found = metrics.classification(slip, predicted, rng.random(count + 2))
    assert found["accuracy"] == pytest.approx(sk.accuracy_score(slip, predicted))
    assert found["precision"] == pytest.approx(sk.precision_score(slip, predicted))
    assert found["recall"] == pytest.approx(sk.recall_score(slip, predicted))
    assert found["f1"] == pytest.approx(sk.f1_score(slip, predicted))
    assert found["false_positive_rate"] == pytest.approx(np.mean(predicted[~slip]))
    assert found["prevalence"] == pytest.approx(slip.mean())
    assert 0 <= found["auc"] <= 1


@given(seeds, st.integers(5, 200))
def test_the_scores_of_an_estimator_are_scikit_learns(seed, count):
    rng = np.random.default_rng(seed)
    true = np.where(rng.random(count) < 0.6, 0.0, rng.uniform(0.008, 0.067, count))
    true[:2] = 0.01, 0.05
    predicted = true + 0.01 * rng.standard_normal(count)
    found, moving = metrics.regression(true, predicted), true > 1e-3
    assert found["mae"] == pytest.approx(sk.mean_absolute_error(true, predicted))
    assert found["rmse"] == pytest.approx(sk.root_mean_squared_error(true, predicted))
    assert found["r2"] == pytest.approx(sk.r2_score(true, predicted))
    assert found["moving_mae"] == pytest.approx(sk.mean_absolute_error(true[moving], predicted[moving]))
    assert found["moving_r2"] == pytest.approx(sk.r2_score(true[moving], predicted[moving]))
    assert found["moving_share"] == pytest.approx(moving.mean())


def test_scores_of_nothing_are_undefined_and_no_error():
    empty = np.zeros(0)
    assert all(math.isnan(v) for v in metrics.regression(empty, empty).values())
    assert all(math.isnan(v) for v in metrics.classification(empty, empty, empty).values())
    still = metrics.regression(np.zeros(3), np.zeros(3))
    assert still["mae"] == 0
    assert math.isnan(still["r2"])
    assert math.isnan(still["moving_mae"])
    assert math.isnan(metrics.coverage(empty, empty, empty))


def test_the_bootstrap_draws_recordings_and_not_frames():
    rng = np.random.default_rng(0)
    level = rng.standard_normal(20)
    recordings = np.repeat([f"r{i}" for i in range(20)], 50).astype(object)
    values = np.repeat(level, 50)
    found = metrics.bootstrap(recordings, lambda rows: float(values[rows].mean()), 500, seed=1)
    assert found.value == pytest.approx(level.mean())
    # The standard error of a mean of 20, not of 1000.
    assert found.high - found.low == pytest.approx(2 * 1.96 * level.std() / math.sqrt(20), rel=0.2)
    assert found.low < found.value < found.high
    assert found == metrics.bootstrap(recordings, lambda rows: float(values[rows].mean()), 500, seed=1)
    assert str(metrics.Interval(0.5, 0.25, 0.75)) == "0.500 [0.250, 0.750]"


def test_the_bootstrap_of_an_undefined_score_is_undefined():
    found = metrics.bootstrap(np.array(["a", "b"], object), lambda rows: math.nan, 20)
    assert all(map(math.isnan, (found.value, found.low, found.high)))


def test_onsets_and_false_alarms():
    t = np.arange(0, 10, 0.1)
    slip = (t > 2.95) & (t < 4.95)
    predicted = (t > 3.15) & (t < 5.05)
    predicted |= (t > 6.95) & (t < 7.25)
    latencies, alarms = metrics.onsets(np.zeros(100, int), t, slip, predicted)
    assert latencies == pytest.approx([0.2])
    still_s = 2.9 + 4.8
    assert alarms == pytest.approx(60 / still_s, rel=0.03), "one run of detections in some eight seconds of rest"
    missed, none = metrics.onsets(np.zeros(100, int), t, slip, np.zeros(100, bool))
    assert missed.tolist() == [math.inf]
    assert none == 0


def test_a_detection_close_to_a_slip_is_no_false_alarm_and_one_that_sounds_all_the_time_is():
    t = np.arange(0, 10, 0.1)
    slip = (t > 2.95) & (t < 4.95)
    latencies, alarms = metrics.onsets(np.zeros(100, int), t, slip, (t > 2.85) & (t < 5.05))
    assert latencies == pytest.approx([0.0])
    assert alarms == 0
    latencies, alarms = metrics.onsets(np.zeros(100, int), t, slip, np.ones(100, bool))
    assert latencies == pytest.approx([0.0])
    assert alarms == pytest.approx(2 * 60 / 7.6, rel=0.03), "one before the slip and one after it"


def test_a_slip_that_a_recording_begins_with_has_no_onset():
    t = np.arange(5) * 0.1
    latencies, _ = metrics.onsets(np.zeros(5, int), t, np.ones(5, bool), np.ones(5, bool))
    assert len(latencies) == 0


def test_coverage():
    assert metrics.coverage(np.array([1.0, 2, 3, 4]), np.full(4, 1.5), np.full(4, 3.0)) == 0.5
