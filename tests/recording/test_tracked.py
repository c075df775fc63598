"""A video that was tracked with a recording replays identically, and a recording can be tracked."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from lsds.cli.main import main
from lsds.errors import DataError
from lsds.session.recording.reader import Recording
from lsds.session.replay import replay
from lsds.session.track import track
from tests.tactile.render import pad_positions, render
from tests.video_files import write_video


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    marks = pad_positions()
    frames = [render(marks + np.array([0.4, 0.2]) * step, noise=1.0, seed=step) for step in range(20)]
    return write_video(tmp_path_factory.mktemp("video") / "clip.avi", frames)


def test_a_tracked_video_replays_identically(video, tmp_path):
    path = tmp_path / "clip.mcap"
    result = track(video, record=path)
    assert result.error is None
    again = replay(path)
    assert again.identical
    assert again.cycles == len(result.t_s) > 15
    assert not Recording(path).header.live


def test_the_frames_of_a_recording_can_be_tracked(video, tmp_path):
    path = tmp_path / "clip.mcap"
    one = track(video, record=path)
    other = track(path)
    assert other.error is None
    assert other.t_s == pytest.approx(one.t_s)
    assert other.kept_fraction == one.kept_fraction
    assert other.speed_m_s == pytest.approx(one.speed_m_s, nan_ok=True)


def test_a_recording_that_is_cut_off_is_an_error_after_its_frames(video, tmp_path):
    path, cut = tmp_path / "clip.mcap", tmp_path / "cut.mcap"
    whole = track(video, record=path)
    data = path.read_bytes()
    cut.write_bytes(data[: len(data) * 2 // 3])
    result = track(cut)
    assert result.error is not None
    assert "cut.mcap: damaged or cut off near byte" in result.error
    assert 0 < len(result.t_s) < len(whole.t_s)
    cut.write_bytes(data[:30_000])
    result = track(cut)
    assert "damaged or cut off near byte" in (result.error or "")


def real_videos():
    folder = Path(os.environ.get("LSDS_DATA", "")) / "incipient_slip" / "videos"
    return sorted(folder.glob("*.avi"))[::40] if os.environ.get("LSDS_DATA") else []


@pytest.mark.skipif(not real_videos(), reason="needs the real recordings (LSDS_DATA)")
@pytest.mark.parametrize("source", real_videos(), ids=lambda path: path.stem)
def test_real_recordings_replay_identically(source, tmp_path):
    path = tmp_path / "real.mcap"
    result = track(source, record=path)
    again = replay(path)
    assert again.identical
    assert again.cycles == len(result.t_s) > 0


def test_labels_and_calibration_read_a_recording_as_a_video(video, tmp_path):
    from lsds_plugins.replay.reader import open_reader
    from lsds_research.slips.recording_view import RecordingView

    path = tmp_path / "clip.mcap"
    track(video, record=path)
    from_video, from_run = list(open_reader(str(video)).images()), list(open_reader(str(path)).images())
    assert len(from_run) == len(from_video)
    for one, other in zip(from_video, from_run, strict=True):
        np.testing.assert_array_equal(one.image, other.image)
        assert one.time_s == pytest.approx(other.time_s, abs=1e-6)
    view = RecordingView(path)
    np.testing.assert_array_equal(view.images, RecordingView(Path(video)).images)


def test_a_recording_that_is_cut_off_is_exported_with_a_warning(video, tmp_path, capsys):
    pytest.importorskip("pyarrow", reason="the export needs the extra data")
    path, cut = tmp_path / "clip.mcap", tmp_path / "cut.mcap"
    track(video, record=path)
    assert main(["record", "export", str(path), "--to", "parquet", "--out", str(tmp_path / "whole")]) == 0
    assert "warning" not in capsys.readouterr().err
    cut.write_bytes(path.read_bytes()[:-20_000])
    assert main(["record", "export", str(cut), "--to", "parquet", "--out", str(tmp_path / "part")]) == 0
    assert "cut.mcap is damaged or cut off near byte" in capsys.readouterr().err


def test_a_recording_without_a_frame_is_no_comparison(video, tmp_path, capsys):
    path, cut = tmp_path / "clip.mcap", tmp_path / "cut.mcap"
    track(video, record=path)
    cut.write_bytes(path.read_bytes()[:20_000])
    assert not replay(cut).complete
    assert main(["replay", str(cut)]) == DataError.exit_code
    assert "nothing to compare (damaged or cut off near byte" in capsys.readouterr().err
