"""A LeRobot dataset: its layout is the documented one, and its values are those of the recording.

The layout is that of https://huggingface.co/docs/lerobot/lerobot-dataset-v3, and of lerobot/datasets/utils.py in
LeRobot 0.4.4: paths, keys of info.json, default features, columns of meta/episodes and index of meta/tasks.parquet.
"""

from __future__ import annotations

import importlib.util
import json
import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from lsds.contracts import ArmState, GripperState, Pose, Twist, Wanted
from lsds.contracts.events import Corrected, JobStepped
from lsds.errors import DataError
from lsds.session.recording.codec import to_json
from lsds.session.recording.export import lerobot
from lsds.session.recording.export.lerobot import to_lerobot
from lsds.session.recording.export.lerobot_dataset import LeRobotDataset
from lsds.session.recording.export.lerobot_features import ACTION, STATE, FingerLayout, Layout
from lsds.session.recording.export.lerobot_samples import samples
from lsds.session.recording.export.lerobot_stats import Running
from lsds.session.recording.files import cut
from lsds.session.recording.messages import ARM, CORRECTION, FRAMES, GRIPPER, JOB
from lsds.session.recording.reader import Raw, Recording
from lsds.session.run import run
from tests.recording.conftest import SHORT

pq = pytest.importorskip("pyarrow.parquet", reason="datasets need the extra data")

TASK = "hold a glass"
INFO = {
    "codebase_version",
    "robot_type",
    "total_episodes",
    "total_frames",
    "total_tasks",
    "chunks_size",
    "data_files_size_in_mb",
    "video_files_size_in_mb",
    "fps",
    "splits",
    "data_path",
    "video_path",
    "features",
}
DEFAULT_FEATURES = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
EPISODE_COLUMNS = {
    "episode_index",
    "tasks",
    "length",
    "data/chunk_index",
    "data/file_index",
    "dataset_from_index",
    "dataset_to_index",
    "meta/episodes/chunk_index",
    "meta/episodes/file_index",
}


@pytest.fixture(scope="module")
def dataset(recorded, tmp_path_factory):
    """A dataset of two episodes, and the number of frames of each."""
    folder = tmp_path_factory.mktemp("lerobot")
    part = folder / "part.mcap"
    cut(recorded[0], part, 0.0, 3.0)
    written = to_lerobot([recorded[0], part], folder / "dataset", task=TASK)
    return folder / "dataset", list(written.values())


@pytest.fixture(scope="module")
def info(dataset):
    return json.loads((dataset[0] / "meta" / "info.json").read_text())


def rows(dataset, episode):
    return pq.read_table(dataset[0] / f"data/chunk-000/file-{episode:03d}.parquet").to_pylist()


def test_the_files_are_where_the_format_wants_them(dataset):
    found = {str(file.relative_to(dataset[0])) for file in dataset[0].rglob("*") if file.is_file()}
    assert found == {
        "meta/info.json",
        "meta/stats.json",
        "meta/tasks.parquet",
        *(f"{folder}/chunk-000/file-00{n}.parquet" for folder in ("data", "meta/episodes") for n in (0, 1)),
    }


def test_the_info_has_the_documented_keys(info, dataset):
    assert set(info) == INFO
    assert (info["codebase_version"], info["fps"], info["splits"]) == ("v3.0", 25, {"train": "0:2"})
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (2, sum(dataset[1]), 1)
    assert info["data_path"] == "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
    assert info["video_path"] is None
    assert {name: info["features"][name] for name in DEFAULT_FEATURES} == {
        name: {"dtype": kind, "shape": [1], "names": None} for name, kind in DEFAULT_FEATURES.items()
    }
    assert not [name for name in info["features"] if "/" in name]


def test_the_features_are_images_tactile_values_state_and_action(info):
    features = info["features"]
    image = {"dtype": "image", "shape": [240, 320, 3], "names": ["height", "width", "channels"]}
    assert features["observation.images.finger"] == image
    assert features["observation.tactile.finger.displacement"]["shape"] == [126]
    assert features["observation.tactile.finger.load"]["names"] == ["shear_x_n", "shear_y_n", "torque_nm"]
    assert features["observation.state"]["names"][:4] == ["aperture_m", "tcp_x_m", "tcp_y_m", "tcp_z_m"]
    assert features["action"]["names"][:4] == ["aperture_m", "tcp_vx_m_s", "tcp_vy_m_s", "tcp_vz_m_s"]
    for feature in features.values():
        assert feature["names"] is None or len(feature["names"]) == math.prod(feature["shape"]) or feature == image


def test_the_columns_have_the_types_of_the_features(info, dataset):
    schema = pq.read_schema(dataset[0] / "data/chunk-000/file-000.parquet")
    assert schema.names == list(info["features"])
    for name, feature in info["features"].items():
        if feature["dtype"] == "image":
            assert [field.name for field in schema.field(name).type] == ["bytes", "path"]
        elif feature["shape"] == [1]:
            assert str(schema.field(name).type) == {"float32": "float", "int64": "int64"}[feature["dtype"]]
        else:
            assert schema.field(name).type.list_size == feature["shape"][0]


def test_frames_are_counted_through_all_episodes(dataset):
    first, second = rows(dataset, 0), rows(dataset, 1)
    assert [len(first), len(second)] == dataset[1]
    assert [row["index"] for row in first + second] == list(range(sum(dataset[1])))
    assert [row["frame_index"] for row in second] == list(range(len(second)))
    assert {row["episode_index"] for row in second} == {1}
    assert [row["timestamp"] for row in first] == pytest.approx([n / 25 for n in range(len(first))])
    episodes = [
        pq.read_table(dataset[0] / f"meta/episodes/chunk-000/file-{n:03d}.parquet").to_pylist()[0] for n in (0, 1)
    ]
    assert {name for name in episodes[0] if not name.startswith("stats/")} == EPISODE_COLUMNS
    assert [(own["dataset_from_index"], own["dataset_to_index"]) for own in episodes] == [
        (0, len(first)),
        (len(first), sum(dataset[1])),
    ]
    assert [(own["tasks"], own["length"], own["data/file_index"]) for own in episodes] == [
        ([TASK], len(first), 0),
        ([TASK], len(second), 1),
    ]
    assert "stats/observation.state/mean" in episodes[0]


def test_the_task_is_the_index_of_its_table(dataset):
    table = pq.read_table(dataset[0] / "meta/tasks.parquet")
    assert json.loads(table.schema.metadata[b"pandas"])["index_columns"] == ["task"]
    assert table.to_pylist() == [{"task_index": 0, "task": TASK}]


def test_pandas_reads_the_task_as_index(dataset):
    pandas = pytest.importorskip("pandas")
    tasks = pandas.read_parquet(dataset[0] / "meta/tasks.parquet")
    assert (tasks.iloc[0].name, tasks.loc[TASK].task_index) == (TASK, 0)


def test_values_are_those_of_the_recording(recorded, dataset):
    found = rows(dataset, 0)
    stored = {frame.image.tobytes() for _, frame in Recording(recorded[0]).frames()}
    for row in found[::20]:
        bgr = cv2.imdecode(np.frombuffer(row["observation.images.finger"]["bytes"], np.uint8), cv2.IMREAD_COLOR)
        assert cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB).tobytes() in stored
    states = np.array([row[STATE] for row in found])
    assert states[0, 0] == pytest.approx(0.05)
    assert states[-1, 3] - states[0, 3] == pytest.approx(0.023, abs=0.005)
    actions = np.array([row[ACTION] for row in found])
    assert np.isfinite(states).all()
    assert np.isfinite(actions).all()
    assert actions[:, 3].max() == pytest.approx(0.038, abs=0.02)
    loads = np.array([row["observation.tactile.finger.load"] for row in found])
    assert np.abs(loads[-1, :2]).max() > 100 * np.abs(loads[0, :2]).max()


def test_statistics_are_those_of_all_frames(dataset):
    stats = json.loads((dataset[0] / "meta/stats.json").read_text())
    states = np.array([row[STATE] for n in (0, 1) for row in rows(dataset, n)])
    assert stats[STATE]["mean"] == pytest.approx(states.mean(axis=0))
    assert stats[STATE]["std"] == pytest.approx(states.std(axis=0), abs=1e-9)
    assert stats[STATE]["min"] == pytest.approx(states.min(axis=0))
    assert stats[STATE]["max"] == pytest.approx(states.max(axis=0))
    assert stats[STATE]["count"] == [len(states)]
    image = stats["observation.images.finger"]
    assert np.shape(image["mean"]) == (3, 1, 1)
    assert 0 < np.min(image["mean"]) < np.max(image["max"]) <= 1


def test_merged_statistics_are_those_of_all_values():
    values = np.random.default_rng(0).normal(3.0, 2.0, (50, 4))
    one, other = Running(), Running()
    for row in values[:10]:
        one.add(row[None])
    other.add(values[10:])
    one.merge(other)
    assert one.stated((-1,))["std"] == pytest.approx(values.std(axis=0))
    assert one.stated((-1,))["mean"] == pytest.approx(values.mean(axis=0))


# -- sampling -------------------------------------------------------------------------------------------------

LAYOUT = Layout((FingerLayout("f", 4, 4, 1, True),), True)
STILL = Twist((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
UP = Twist((0.0, 0.0, 0.1), (0.0, 0.0, 0.0))


def message(topic, now_ms, value):
    now_ns = now_ms * 1_000_000
    return Raw(topic, "", "json", json.dumps(to_json(value)).encode(), now_ns, now_ns)


def picture(now_ms, text=b"x"):
    from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

    data = CompressedImage(data=text).SerializeToString()
    return Raw("/finger/f/image", "foxglove.CompressedImage", "protobuf", data, now_ms * 1_000_000, 0)


def streams(*more, load=(0.0, 1.0)):
    """All streams at 0 ms, others, and an end at 95 ms."""
    return [
        message(GRIPPER, 0, GripperState(0, 0, 0.05, 0.04, True)),
        message(ARM, 0, ArmState(0, 0, Pose((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0)), STILL)),
        picture(0),
        message("/finger/f/field", 0, {"displacement_m": [[1e-3, math.nan]]}),
        message("/finger/f/load", 0, {"shear_n": list(load), "torque_nm": 0.5}),
        *more,
        message(FRAMES, 95, {}),
    ]


def sampled(messages, layout=LAYOUT, rate_hz=50):
    return [sample for _, sample in samples(iter(messages), layout, rate_hz, Path("run.mcap"))]


def test_a_sample_holds_what_was_known_at_its_instant():
    found = sampled(streams(message(GRIPPER, 30, GripperState(0, 0, 0.03, 0.04, True)), picture(50, b"y")))
    assert len(found) == 5
    assert [sample[STATE][0] for sample in found] == pytest.approx([0.05, 0.05, 0.03, 0.03, 0.03])
    assert [sample["observation.images.f"] for sample in found] == [b"x", b"x", b"x", b"y", b"y"]
    assert found[0][STATE] == pytest.approx([0.05, 1, 2, 3, 0, 0, 0, 1])
    assert found[0]["observation.tactile.f.load"] == pytest.approx([0, 1, 0.5])


def test_the_action_is_what_was_commanded_until_the_next_sample():
    job = message(JOB, 30, JobStepped(0, Wanted("lift", None, False, UP), True, 0.02))
    corrected = message(CORRECTION, 50, Corrected(0, 0.019, 0.018))
    refused = message(CORRECTION, 70, Corrected(0, 0.017, None))
    rest = message(JOB, 71, JobStepped(0, Wanted("hold", None, False), False, 0.018))
    found = np.array([sample[ACTION] for sample in sampled(streams(job, corrected, refused, rest))])
    # Before the first command it is the target that the gripper states.
    assert found[:, 0] == pytest.approx([0.04, 0.02, 0.018, 0.018, 0.018])
    assert found[:, 3] == pytest.approx([0.0, 0.1, 0.1, 0.0, 0.0])


def test_an_unknown_number_keeps_its_last_value_and_the_episode_begins_when_all_are_known():
    key = "observation.tactile.f.displacement"
    moved = message("/finger/f/field", 30, {"displacement_m": [[math.nan, 2e-3]]})
    found = sampled(streams(moved))
    assert found[0][key] == pytest.approx([1e-3, 0.0])
    assert found[-1][key] == pytest.approx([1e-3, 2e-3])
    late = message("/finger/f/load", 60, {"shear_n": [5.0, 5.0], "torque_nm": 0.0})
    assert len(sampled(streams(late, load=(math.nan, math.nan)))) == 2
    assert sampled(streams(load=(math.nan, 0.0))) == []


def test_a_message_of_another_form_is_an_error_with_its_place():
    moved = message("/finger/f/field", 30, {"displacement_m": [[0.0, 0.0], [0.0, 0.0]]})
    with pytest.raises(DataError, match=r"run.mcap: a message of /finger/f/field at 30000000 ns .*4 numbers, not 2"):
        sampled(streams(moved))


def test_without_an_arm_state_and_action_are_the_aperture(tmp_path):
    layout = Layout(LAYOUT.fingers, False)
    found = sampled([raw for raw in streams() if raw.topic != ARM], layout)
    assert (found[0][STATE].tolist(), len(found[0][ACTION])) == ([pytest.approx(0.05)], 1)
    LeRobotDataset(tmp_path, layout.features(), 50, TASK)._write_rows(tmp_path / "a.parquet", found, _NoStatistics())
    assert str(pq.read_schema(tmp_path / "a.parquet").field(STATE).type) == "float"


class _NoStatistics:
    def add(self, row, frame_index):
        pass


# -- failures -------------------------------------------------------------------------------------------------


def test_complete_episodes_stay_when_a_later_one_fails(recorded, tmp_path, monkeypatch):
    out = tmp_path / "dataset"
    real, calls = lerobot.samples, []

    def failing(messages, *rest):
        calls.append(1)
        for number, each in enumerate(real(messages, *rest)):
            if len(calls) == 2 and number == 70:
                raise OSError(28, "No space left on device")
            yield each

    monkeypatch.setattr(lerobot, "samples", failing)
    with pytest.raises(DataError, match="No space left"):
        to_lerobot([recorded[0], recorded[0]], out)
    info = json.loads((out / "meta/info.json").read_text())
    assert info["total_episodes"] == 1
    assert sorted(file.name for file in (out / "data").rglob("*.*")) == ["file-000.parquet"]
    calls[:] = [1]
    with pytest.raises(DataError, match="No space left"):
        to_lerobot([recorded[0]], tmp_path / "other")
    assert not (tmp_path / "other").exists()


def test_recordings_that_cannot_be_one_dataset_are_refused_before_anything_is_written(recorded, tmp_path):
    other, out = tmp_path / "other.mcap", tmp_path / "out"
    run(None, [*SHORT, "sensors.left.backend=mock-gelsight-mini"], record=other)
    with pytest.raises(DataError, match=r"other.mcap: differs from .*run.mcap in the names of the fingers"):
        to_lerobot([recorded[0], other], out)
    short = tmp_path / "short.mcap"
    cut(recorded[0], short, 0.0, 0.2)
    with pytest.raises(DataError, match=r"short.mcap: a LeRobot dataset needs /finger/finger/field"):
        to_lerobot([short], out)
    assert not out.exists()


def test_no_path_is_overwritten(recorded, tmp_path):
    with pytest.raises(DataError, match="exists already"):
        to_lerobot([recorded[0]], tmp_path)


def test_another_rate_gives_another_number_of_frames(recorded, dataset, tmp_path):
    (frames,) = to_lerobot([recorded[0]], tmp_path / "slow", rate_hz=5).values()
    assert frames == pytest.approx(dataset[1][0] / 5, abs=1)


def missing_for_lerobot():
    return [name for name in ("lerobot", "datasets", "torchvision", "av") if importlib.util.find_spec(name) is None]


@pytest.mark.slow
@pytest.mark.skipif(bool(missing_for_lerobot()), reason=f"LeRobot needs {', '.join(missing_for_lerobot())}")
@pytest.mark.filterwarnings("ignore")
def test_lerobot_reads_it(dataset, monkeypatch, tmp_path):
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    monkeypatch.setenv("HF_HOME", str(tmp_path))
    from lerobot.datasets.lerobot_dataset import LeRobotDataset as Theirs

    found = Theirs("local/lsds", root=dataset[0])
    assert (found.num_episodes, found.num_frames, found.fps) == (2, sum(dataset[1]), 25)
    at = dataset[1][0] + 5
    item, row = found[at], rows(dataset, 1)[5]
    assert item["observation.images.finger"].shape == (3, 240, 320)
    assert item["task"] == TASK
    for name in (STATE, ACTION, "observation.tactile.finger.displacement", "observation.tactile.finger.load"):
        np.testing.assert_array_equal(item[name].numpy(), np.array(row[name], np.float32))
    one = Theirs("local/lsds", root=dataset[0], episodes=[1], delta_timestamps={STATE: [-1 / 25, 0.0]})
    assert len(one) == dataset[1][1]
    assert one[5][STATE].shape == (2, 8)
