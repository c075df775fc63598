"""Clips of equal length: what is measured on known motion, and that a recording's length leaves no trace."""

from __future__ import annotations

import numpy as np
import pytest
from lsds_research.clips.features import CLIP_FRAMES, CUTS, FEATURES, clip_features, placements, quantiles
from lsds_research.clips.signals import CLIP_SIGNALS, LAGS, clip_signals, lag_of
from lsds_research.incipient.table import two_frame, videos_of, while_moving
from research.labelled import dataset

from lsds.errors import DataError

GRID = np.stack(np.meshgrid(np.arange(9.0), np.arange(7.0)), axis=-1).reshape(-1, 2)
CENTRED = GRID - GRID.mean(axis=0)


def signal(found, name):
    return found[:, CLIP_SIGNALS.index(name)]


def growing(field, frames=8, each=0.01):
    return each * np.arange(frames)[:, None, None] * field


def test_a_carried_field_has_no_shape_and_goes_one_way():
    found = clip_signals(growing(np.ones((63, 2))), GRID)
    for lag in LAGS:
        assert signal(found, f"clip_net_{lag}")[lag:] == pytest.approx(0.01 * lag * np.sqrt(2), rel=1e-5)
        assert np.isnan(signal(found, f"clip_net_{lag}")[:lag]).all()
        for name in ("bent", "div", "curl", "strain"):
            assert signal(found, f"clip_{name}_{lag}")[lag:] == pytest.approx(0, abs=1e-6)
    assert (signal(found, "clip_even_6")[6:] > 0.95).all()


@pytest.mark.parametrize(
    ("field", "name", "value"),
    [
        (CENTRED, "clip_div", 0.02),
        (CENTRED @ np.array([[0, 1], [-1, 0]]), "clip_curl", 0.02),
        (CENTRED * [1, -1], "clip_strain", 0.02),
        (CENTRED[:, ::-1], "clip_strain", 0.02),
    ],
)
def test_spread_turn_and_strain_differ(field, name, value):
    found = clip_signals(growing(field), GRID)
    assert signal(found, name)[1] == pytest.approx(value, rel=1e-4)
    assert signal(found, f"{name}_3")[3:] == pytest.approx(3 * value, rel=1e-4)
    for other in {"clip_div", "clip_curl", "clip_strain", "clip_bent"} - {name}:
        assert signal(found, other)[1] == pytest.approx(0, abs=1e-6)


def test_lost_markers_are_left_out_and_too_few_say_nothing():
    moved = growing(np.ones((63, 2)))
    moved[4, :30] = np.nan
    moved[5, 9:] = np.nan
    found = clip_signals(moved, GRID)
    assert signal(found, "clip_net_1")[4] == pytest.approx(0.01 * np.sqrt(2), rel=1e-5)
    assert np.isnan(found[5]).all()
    assert np.isfinite(signal(found, "clip_held")[6])


@pytest.mark.parametrize("count", [10, 48, 49, 53, 130, 450])
@pytest.mark.parametrize(("pieces", "times"), CUTS)
def test_every_clip_has_as_many_frames_and_all_are_the_recording_s(count, pieces, times):
    rows = placements(count, pieces, times)
    assert rows.shape == (times, CLIP_FRAMES)
    assert rows.min() >= 0
    assert rows.max() < count
    if count >= CLIP_FRAMES:
        assert all(len(np.unique(clip)) == CLIP_FRAMES for clip in rows)
        piece = rows.reshape(times, pieces, -1)
        assert (np.diff(piece, axis=2) == 1).all()


def test_quantiles_leave_out_what_is_undefined():
    values = np.array([3.0, np.nan, 1.0, 2.0, np.nan])[None, :, None]
    assert [float(q[0, 0]) for q in quantiles(values, (0, 0.5, 1))] == [1, 2, 3]
    assert np.isnan(quantiles(np.full((1, 4, 1), np.nan), (0.5,))[0]).all()
    rng = np.random.default_rng(0)
    clips = rng.random((3, 20, 4))
    np.testing.assert_allclose(quantiles(clips, (0.9,))[0], np.quantile(clips, 0.9, axis=1))


def test_the_length_of_a_recording_leaves_no_trace():
    """The same process, short and long: a maximum over the recording separates them, no statistic of a clip does."""
    rng = np.random.default_rng(0)
    width = len(CLIP_SIGNALS)
    short = [rng.gamma(1.0, size=(60, width)).astype(np.float32) for _ in range(80)]
    long = [rng.gamma(1.0, size=(450, width)).astype(np.float32) for _ in range(80)]
    a, b = (np.array([clip_features(x) for x in group]) for group in (short, long))
    assert a.shape == (80, len(FEATURES))
    apart = (a.mean(axis=0) - b.mean(axis=0)) / np.sqrt((a.var(axis=0) + b.var(axis=0)) / 80)
    assert np.abs(apart).mean() < 1.0  # 0.8 where nothing is there.
    assert np.abs(apart).max() < 4.8
    over_all = [np.array([x.max(axis=0) for x in group]) for group in (short, long)]
    assert over_all[1].mean() > over_all[0].mean() + 1.5


def test_what_a_piece_s_first_frames_say_of_earlier_ones_is_not_the_clip_s():
    rng = np.random.default_rng(0)
    signals = rng.random((CLIP_FRAMES, len(CLIP_SIGNALS))).astype(np.float32)
    other = signals.copy()
    for index, name in enumerate(CLIP_SIGNALS):
        other[: lag_of(name), index] = 1e6
    np.testing.assert_array_equal(clip_features(signals), clip_features(other))


def test_a_table_has_a_row_a_video_and_leaves_doubtful_ones_out():
    data = dataset(3)
    data["slip"][data["recording"] == "thing0__e0__cam0"] = -1
    videos = videos_of(data)
    assert len(videos) == 11
    assert "thing0__e0__cam0" not in videos.name
    assert set(videos.recording) == {f"thing{k}__e{n}" for k in range(3) for n in range(2)}
    assert videos.clip.shape == (11, len(FEATURES))
    assert set(videos.frames) == {60, 90}


def test_labels_that_are_all_in_doubt_are_an_error():
    data = dataset(1)
    data["slip"][:] = -1
    with pytest.raises(DataError, match="all labels of the recordings are in doubt"):
        videos_of(data)


def test_only_frames_that_move_count():
    values = np.array([5.0, 1.0, 2.0, 3.0, np.nan, 9.0])
    moved = np.array([False, True, True, True, True, False])
    assert while_moving(values, moved, 0.5) == 2.0
    assert while_moving(values, np.zeros(6, bool), 0.5, -1.0) == -1.0


def test_the_two_frame_maximum_remembers_one_frame():
    np.testing.assert_array_equal(two_frame(np.array([1.0, 3.0, 2.0, 0.0])), [1, 3, 3, 2])
