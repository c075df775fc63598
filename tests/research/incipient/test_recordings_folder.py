"""A folder of labelled videos: its index, what is wrong with it, and the dataset that it becomes."""

from __future__ import annotations

import os

import numpy as np
import pytest
from lsds_research.clips.signals import CLIP_SIGNALS
from lsds_research.datasets import COLUMNS
from lsds_research.incipient import load as incipient_load
from lsds_research.incipient import video as incipient_video
from lsds_research.incipient.index import physical, read_index
from lsds_research.incipient.load import load
from lsds_research.incipient.look import LOOKS
from research.labelled import HEADER, film, row, write_index

from lsds.errors import DataError


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Two cameras of a recording with slip, one of a doubtful one, a broken video and one that is not there."""
    folder = tmp_path_factory.mktemp("recorded")
    rows = [row(1, "cam0", 1), row(1, "cam2", 1), row(2, conflict=1), row(3), row(4)]
    for number, listed in enumerate(rows[:3]):
        film(folder / listed["video"], seed=number)
    (folder / rows[3]["video"]).write_bytes(b"RIFF but no video")
    write_index(folder, rows)
    return folder


@pytest.fixture(scope="module")
def data(recorded):
    return load(recorded)


@pytest.fixture
def read_once(recorded, data, monkeypatch):
    """Videos as read for `data`, for tests of the later steps."""
    known = {name: data.where(data["recording"] == name).columns for name in dict.fromkeys(data["recording"].tolist())}
    monkeypatch.setattr(
        incipient_load, "try_columns", lambda video: known.get(video.name, data.card["failures"].get(video.name))
    )


def test_videos_become_a_dataset_of_one_row_a_frame(data):
    assert set(COLUMNS) | set(CLIP_SIGNALS) | set(LOOKS) == set(data.columns)
    assert list(dict.fromkeys(data["recording"])) == ["thing1__e1__cam0", "thing1__e1__cam2", "thing2__e2__cam0"]
    assert [physical(name) for name in dict.fromkeys(data["recording"])] == ["thing1__e1", "thing1__e1", "thing2__e2"]
    assert set(data["object"]) == {"thing1", "thing2"}
    assert set(data["protocol"]) == {"real"}
    first = data.where(data["recording"] == "thing1__e1__cam0")
    assert len(first) == 15
    assert set(first["slip"]) == {1}
    assert set(data["slip"][data["object"] == "thing2"]) == {-1}
    # 0.4 px a frame on a pitch of 33 px, and 62.5 um a pixel at 25 Hz.
    assert np.nanmax(first["clip_net_1"]) == pytest.approx(0.4 / 33, rel=0.15)
    assert np.nanmax(first["clip_net"]) == pytest.approx(2.0 / 33, rel=0.1)
    assert np.nanmax(first["v_net"]) == pytest.approx(0.4 * 62.5e-6 * 25, rel=0.15)
    assert (first["brightness"] > 20).all()
    assert (first["markers"] == 63).all()


def test_unreadable_videos_are_reported_and_the_rest_is_kept(data):
    failures = data.card["failures"]
    assert sorted(failures) == ["thing3__e3__cam0", "thing4__e4__cam0"]
    for name, reason in failures.items():
        assert name in reason


def test_a_video_on_which_a_library_fails_is_reported_and_the_rest_is_kept(recorded, monkeypatch):
    known = incipient_video.columns_of

    def one_fails(video):
        if video.name == "thing1__e1__cam2":
            raise ValueError("singular matrix")
        return known(video)

    monkeypatch.setattr(incipient_video, "columns_of", one_fails)
    data = load(recorded)
    assert "ValueError: singular matrix" in data.card["failures"]["thing1__e1__cam2"]
    assert set(data["recording"]) == {"thing1__e1__cam0", "thing2__e2__cam0"}


@pytest.mark.usefixtures("read_once")
def test_a_second_time_comes_from_the_cache_until_a_video_changes(recorded, tmp_path, monkeypatch):
    seen = []
    first = load(recorded, cache=tmp_path, progress=lambda done, whole: seen.append((done, whole)))
    assert seen == [(k, 5) for k in range(1, 6)]
    monkeypatch.setattr(incipient_load, "try_columns", lambda video: pytest.fail("read again"))
    again = load(recorded, cache=tmp_path)
    assert again.card["failures"] == first.card["failures"]
    for name in first.columns:
        np.testing.assert_array_equal(first[name], again[name])
    os.utime(recorded / "videos" / "thing1__e1__cam0.avi", ns=(1, 1))
    with pytest.raises(pytest.fail.Exception, match="read again"):
        load(recorded, cache=tmp_path)


@pytest.mark.usefixtures("read_once")
def test_a_truncated_cache_is_rebuilt(recorded, tmp_path):
    first = load(recorded, cache=tmp_path)
    frames = next(tmp_path.glob("*/frames.parquet"))
    frames.write_bytes(frames.read_bytes()[:200])
    again = load(recorded, cache=tmp_path)
    np.testing.assert_array_equal(first["v_net"], again["v_net"])


@pytest.mark.usefixtures("read_once")
def test_a_cache_that_cannot_be_written_costs_nothing_but_time(recorded, tmp_path):
    (tmp_path / "file").write_text("not a folder")
    data = load(recorded, cache=tmp_path / "file")
    assert len(data) == 45
    assert "cannot be written" in data.card["not_kept"]


def test_processes_change_nothing(recorded, data):
    two = load(recorded, jobs=2)
    for name in data.columns:
        np.testing.assert_array_equal(data[name], two[name])


def test_a_folder_without_one_good_video_is_an_error(tmp_path):
    write_index(tmp_path, [row(1)])
    with pytest.raises(DataError, match=r"none of its 1 videos can be used.*thing1__e1__cam0\.avi"):
        load(tmp_path)


def test_no_folder_and_no_index_have_different_errors(tmp_path):
    with pytest.raises(DataError, match="there is no such folder"):
        read_index(tmp_path / "nowhere")
    with pytest.raises(DataError, match=r"no index\.csv there \(columns video, recording"):
        read_index(tmp_path)
    write_index(tmp_path, [])
    with pytest.raises(DataError, match="names no videos"):
        read_index(tmp_path)


def test_missing_columns_are_named_all_at_once(tmp_path):
    write_index(tmp_path, [row(1)], [name for name in HEADER if name not in ("slip", "camera")])
    with pytest.raises(DataError, match="columns camera, slip missing"):
        read_index(tmp_path)


def test_a_label_conflict_column_may_be_missing(tmp_path):
    write_index(tmp_path, [row(1, slip=1)], [name for name in HEADER if name != "label_conflict"])
    assert [(video.slip, video.conflict) for video in read_index(tmp_path)] == [(1, False)]


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([row(1) | {"slip": "yes"}], "line 2: slip is 'yes', not 0 or 1"),
        ([row(1) | {"object": ""}], "line 2: object is empty"),
        ([row(1) | {"label_conflict": "maybe"}], "line 2: label_conflict is 'maybe'"),
        ([row(1), row(1)], "recording thing1__e1, camera cam0 is named twice"),
        ([row(1), row(1, "cam2") | {"object": "other"}], "is of thing1 and of other"),
        ([row(1), row(1, "cam2", slip=1)], "has slip 0 and 1"),
        ([row(1) | {"slip": ""}, row(2) | {"slip": "2"}], "line 2: slip is empty; line 3: slip is '2'"),
    ],
)
def test_a_wrong_row_is_reported_by_its_line(tmp_path, rows, message):
    write_index(tmp_path, rows)
    with pytest.raises(DataError, match=message):
        read_index(tmp_path)


def test_an_index_that_is_no_text_is_an_error(tmp_path):
    (tmp_path / "index.csv").write_bytes(b"\xff\xfe\x00video")
    with pytest.raises(DataError, match="cannot be read"):
        read_index(tmp_path)
