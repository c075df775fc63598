"""Folds by object, baselines and controls, and causal decisions."""

from __future__ import annotations

import numpy as np
import pytest
from lsds_research.incipient.folds import (
    by_recording,
    cross_validated,
    fold_count,
    grouped,
    majority_rule,
    permuted,
    require_both,
    scored,
    threshold_rule,
    trained_elsewhere,
)
from lsds_research.incipient.online import (
    PER_VIDEO,
    RULES,
    WINDOW_FRAMES,
    after_counts,
    after_parts,
    aucs,
    online_windows,
    random_fold_auc,
    running,
    window_scores,
)
from lsds_research.incipient.table import videos_of
from research.labelled import dataset

from lsds.errors import DataError


def silent():
    pass


def nearest(x, slip, seed):
    """A tiny model: nearer to the mean of one label than to that of the other, by the columns' medians."""
    x = np.nan_to_num(x)
    scale = x.std(axis=0) + 1e-9
    means = [(x[slip == label] / scale).mean(axis=0) for label in (0, 1)]

    def predict(rows):
        far = [np.linalg.norm(np.nan_to_num(rows) / scale - mean, axis=1) for mean in means]
        return far[0] / (far[0] + far[1])

    return predict


@pytest.fixture(scope="module")
def videos():
    return videos_of(dataset(6))


def test_no_object_is_trained_on_and_tested(videos):
    assert fold_count(videos.object) == 6
    tested = []
    for train, test in grouped(videos.object, videos.slip, 0):
        assert not set(videos.object[train]) & set(videos.object[test])
        tested += test.tolist()
    assert sorted(tested) == list(range(len(videos)))


def test_a_model_learns_and_shuffled_labels_teach_nothing(videos):
    probability = cross_validated(nearest, videos.clip, videos.slip, videos.object, 0, silent)
    assert scored("true", videos.recording, videos.slip, probability).auc.value > 0.95
    dealt = [permuted(videos.slip, videos.recording, seed) for seed in range(12)]
    by_seed = [
        cross_validated(nearest, videos.clip, slip, videos.object, seed, silent) for seed, slip in enumerate(dealt)
    ]
    found = scored("shuffled", videos.recording, np.array(dealt), np.array(by_seed))
    assert 0.25 < found.auc.value < 0.75
    assert found.spread > 0


def test_shuffling_keeps_a_recording_s_cameras_together(videos):
    dealt = permuted(videos.slip, videos.recording, 3)
    assert dealt.sum() == videos.slip.sum()
    assert any(dealt != videos.slip)
    for name in np.unique(videos.recording):
        assert len(set(dealt[videos.recording == name])) == 1


def test_a_fold_that_leaves_one_label_to_train_on_is_passed_over():
    objects = np.array(["a", "a", "b", "b", "c", "c"], object)
    slip = np.array([1, 1, 0, 0, 0, 0])
    probability = cross_validated(nearest, np.arange(6.0)[:, None], slip, objects, 0, silent)
    assert (probability[:2] == 0.5).all()


def test_labels_of_one_object_cannot_be_tested(videos):
    require_both(videos.slip, videos.object)
    with pytest.raises(DataError, match=r"recordings with slip are of 1 object, but .* at least two .*--train"):
        require_both(np.array([1, 0, 0]), np.array(["a", "b", "c"], object))


def test_the_rule_of_one_number_finds_the_number():
    x = np.array([0.1, 0.2, 0.3, 0.8, 0.9])[:, None]
    predict = threshold_rule(x, np.array([0, 0, 0, 1, 1]), 0)
    np.testing.assert_array_equal(predict(np.array([[0.5], [0.6], [np.nan], [2.0]])) > 0.5, [False, True, False, True])


def test_the_majority_rule_is_constant():
    probability = majority_rule(np.zeros((5, 1)), np.array([0, 0, 0, 1, 1]), 0)(np.zeros((3, 1)))
    row = scored("majority", np.array(["a", "b", "c"], object), np.array([0, 1, 0]), probability)
    assert row.auc.value == 0.5
    assert row.accuracy.value == pytest.approx(2 / 3)


def test_a_recording_is_decided_by_both_cameras_together():
    recordings = np.array(["a", "a", "b", "b"], object)
    slip, probability = np.array([1, 1, 0, 0]), np.array([0.9, 0.3, 0.6, 0.1])
    np.testing.assert_allclose(by_recording(recordings, probability), [0.6, 0.35])
    together = scored("m", recordings, slip, probability)
    alone = scored("m", recordings, slip, probability, per_video=True)
    assert (together.auc.value, together.accuracy.value, together.unit) == (1.0, 1.0, "recording")
    assert (alone.auc.value, alone.accuracy.value, alone.unit) == (0.75, 0.5, "video")


def test_training_elsewhere_leaves_out_what_is_tested(videos):
    seen = {}

    def spy(x, slip, seed):
        seen["rows"] = len(x)
        return nearest(x, slip, seed)

    test = videos_of(dataset(2))
    probability, own = trained_elsewhere(spy, videos, test, 0)
    assert seen["rows"] == own.sum() == 16
    assert set(videos.object[own]) == {f"thing{k}" for k in range(2, 6)}
    assert scored("elsewhere", test.recording, test.slip, probability).auc.value > 0.9
    with pytest.raises(DataError, match="has no objects"):
        trained_elsewhere(spy, test, videos, 0)


def test_windows_know_nothing_of_the_future(videos):
    windows = online_windows(videos)
    assert len(windows.slip) == len(videos.data)
    assert len(windows.picked) == PER_VIDEO * len(videos)
    cut = dataset(6).columns
    later = cut["frame"] >= 40
    for name in cut:
        if name.startswith("clip_"):
            cut[name][later] = 7.0
    other = online_windows(videos_of(type(videos.data)(cut, videos.data.card)))
    early = videos.data["frame"] < 40
    np.testing.assert_array_equal(windows.x[early], other.x[early])
    assert (windows.x[~early] != other.x[~early]).any()
    width = windows.x.shape[1] // 3
    own = np.nan_to_num(windows.x[:, :width])
    np.testing.assert_allclose(windows.x[50, width : 2 * width], own[51 - WINDOW_FRAMES : 51].mean(axis=0), rtol=1e-9)


def test_running_decisions_rest_on_what_was_seen(videos):
    windows = online_windows(videos)
    probability = np.random.default_rng(0).random(len(windows.slip))
    for name, rule in RULES.items():
        course = running(windows, probability, rule)
        assert [len(part) for part in course] == videos.frames.astype(int).tolist()
        first = probability[: len(course[0])]
        expected = {
            "mean": first[:31].mean(),
            "90 % quantile": np.quantile(first[:31], 0.9),
            "maximum": first[:31].max(),
        }
        assert course[0][30] == pytest.approx(expected[name])
    assert after_parts(course, (0.5, 1.0))[0] == pytest.approx([course[0][44], course[0][-1]])
    assert after_counts(course, (12, 75))[:, 1] == pytest.approx([part[min(75, len(part)) - 1] for part in course])


def test_online_scores_find_slip_and_random_folds_leak(videos):
    windows = online_windows(videos)
    probability = window_scores(nearest, windows, 0, silent)
    assert aucs(videos, after_parts(running(windows, probability, RULES["mean"]), (1.0,)))[0] > 0.95
    assert random_fold_auc(nearest, windows, windows.slip, 5, 0, silent) > 0.8
