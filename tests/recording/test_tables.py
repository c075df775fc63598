"""A stream as a table: exact numbers, SI units, one column per field; Parquet files of all streams."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from lsds.contracts import Twist, Wanted
from lsds.contracts.events import JobStepped
from lsds.errors import DataError, MissingExtra
from lsds.session.recording import tables
from lsds.session.recording.export.content import content
from lsds.session.recording.export.flatten import flattened, unit_of
from lsds.session.recording.export.kinds import Columns, declared, kind_of, merged
from lsds.session.recording.export.parquet import to_parquet
from lsds.session.recording.files import contents
from lsds.session.recording.reader import Recording
from lsds.session.recording.writer import RecordingWriter

pq = pytest.importorskip("pyarrow.parquet", reason="tables need the extra data")


@pytest.fixture(scope="module")
def folder(recorded, tmp_path_factory):
    out = tmp_path_factory.mktemp("tables") / "run"
    to_parquet(recorded[0], out)
    return out


def units(schema):
    return {field.name: field.metadata[b"unit"].decode() for field in schema if field.metadata}


def test_every_topic_has_a_file_with_all_its_messages(recorded, folder):
    topics = contents(recorded[0])["topics"]
    rows = {
        pq.read_schema(file).metadata[b"topic"].decode(): pq.read_metadata(file).num_rows for file in folder.iterdir()
    }
    assert rows == {name: own["messages"] for name, own in topics.items()}
    assert (folder / "finger.finger.field.parquet").exists()


def test_numbers_and_times_are_those_of_the_recording(recorded, folder):
    path, _ = recorded
    rows = pq.read_table(folder / "gripper.state.parquet").to_pylist()
    raws = [raw for raw in Recording(path).messages() if raw.topic == "/gripper/state"]
    assert [row["aperture_m"] for row in rows] == [raw.value["aperture_m"] for raw in raws]
    assert [(row["now_ns"], row["t_ns"]) for row in rows] == [(raw.now_ns, raw.t_ns) for raw in raws]


def test_arrays_are_lists_and_columns_have_si_units(folder):
    field = pq.read_table(folder / "finger.finger.field.parquet")
    moved = np.array(field["displacement_m"][-1].as_py(), float)
    assert moved.shape == (63, 2)
    assert 0 < np.nanmax(np.abs(moved)) < 0.01
    assert units(field.schema) == {
        "now_ns": "ns",
        "t_ns": "ns",
        "dt_s": "s",
        "displacement_m": "m",
        "velocity_m_s": "m/s",
    }
    assert units(pq.read_schema(folder / "finger.finger.features.parquet"))["angular_velocity"] == "rad/s"
    assert units(pq.read_schema(folder / "arm.tcp.parquet"))["pose.position.z"] == "m"


def test_images_are_the_recorded_bytes(recorded, folder):
    stored = pq.read_table(folder / "finger.finger.image.parquet")["data"][3].as_py()
    images = [raw for raw in Recording(recorded[0]).messages() if raw.topic == "/finger/finger/image"]
    assert stored == content(images[3], recorded[0])["data"]
    assert stored.startswith(b"\x89PNG")


def test_one_stream_is_a_table_of_the_same_form(recorded, folder):
    found = tables.table(recorded[0], "/job")
    assert found.schema.equals(pq.read_schema(folder / "job.parquet"), check_metadata=False)
    assert found.equals(pq.read_table(folder / "job.parquet"))
    assert found["wanted.grip.aperture_m"].null_count < len(found)
    assert "wanted.grip" not in found.column_names


def test_an_unknown_topic_is_an_error_that_lists_the_topics(recorded):
    with pytest.raises(DataError, match=r"no topic '/grap' .*/grip"):
        tables.table(recorded[0], "/grap")


def test_a_data_frame_has_the_units(recorded):
    pytest.importorskip("pandas", reason="a DataFrame needs pandas")
    found = tables.frame(recorded[0], "/grip")
    assert found.attrs["units"]["squeeze_m"] == "m"
    assert found["limit_n"].dtype == float
    assert found["now_ns"].is_monotonic_increasing


def test_without_pandas_the_error_names_it(recorded, monkeypatch):
    monkeypatch.setattr(tables, "importable", lambda name: False)
    with pytest.raises(MissingExtra, match="pip install pandas"):
        tables.frame(recorded[0], "/grip")


def test_infinite_numbers_and_absent_objects_are_numbers_and_nulls(recorded, tmp_path):
    path = tmp_path / "small.mcap"
    writer = RecordingWriter(path, Recording(recorded[0]).header)
    wanted = Wanted("lift", None, False, Twist((0.0, 0.0, math.inf), (0.0, 0.0, 0.0)), touch_m=math.nan)
    writer.observe(JobStepped(10, wanted, False, math.nan))
    writer.observe(JobStepped(20, replace(wanted, twist=None), False, 0.02))
    writer.close()
    rows = tables.table(path, "/job").to_pylist()
    assert [row["wanted.twist.linear_m_s"] for row in rows] == [[0.0, 0.0, math.inf], None]
    assert [row["held_m"] for row in rows] == [None, 0.02]
    assert rows[0]["wanted.grip.aperture_m"] is None


def test_no_path_is_overwritten_and_a_failed_export_leaves_nothing(recorded, tmp_path, monkeypatch):
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "work.txt").write_text("kept")
    with pytest.raises(DataError, match="exists already"):
        to_parquet(recorded[0], mine)
    assert [file.name for file in mine.iterdir()] == ["work.txt"]
    with pytest.raises(DataError, match="no folder"):
        to_parquet(recorded[0], tmp_path / "missing" / "out")

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(pq.ParquetWriter, "write_table", full)
    with pytest.raises(DataError, match=r"No space left.*free some space"):
        to_parquet(recorded[0], tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("value", "columns"),
    [
        ({"a": {"b": 1, "c": {"d": None}}}, {"a.b": 1, "a.c.d": None}),
        ({"a": [{"b": 1}, {"c": 2}]}, {"a.b": [1, None], "a.c": [None, 2]}),
        ({"a": [[1, 2], [3, 4]], "e": []}, {"a": [[1, 2], [3, 4]], "e": []}),
        ({"p": {}}, {}),
        (5, {"value": 5}),
    ],
)
def test_nested_objects_become_columns(value, columns):
    assert flattened(value) == columns


@pytest.mark.parametrize(
    ("name", "unit"),
    [("a.speed_m_s", "m/s"), ("torque_nm", "N m"), ("t_ns", "ns"), ("load_n_s", "N/s"), ("slip", ""), ("v_x", "m/s")],
)
def test_the_unit_is_that_of_the_name(name, unit):
    assert unit_of(name) == unit


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        ([1, None], "int64"),
        ([1, 2.5], "double"),
        ([1.0, "inf"], "double"),
        (["a", 1], "string"),
        ([[1], [2.0], []], ("list", "double")),
        ([True, None], "bool"),
        ([True, 1], "string"),
        ([b"x"], "binary"),
    ],
)
def test_a_column_has_the_kind_that_holds_all_its_values(values, kind):
    found = "null"
    for value in values:
        found = merged(found, kind_of(value))
    assert found == kind


def test_a_column_without_a_value_is_an_unknown_number_and_a_declared_one_keeps_its_kind():
    schema = {"type": "object", "properties": {"slip": {"anyOf": [{"type": "boolean"}, {"type": "null"}]}}}
    assert declared(json.dumps(schema).encode()) == {"slip": "bool"}
    assert declared(b"\x00\xff") == {}
    columns = Columns(json.dumps(schema).encode())
    columns.see({"slip": None, "score": None, "marks": [None]})
    assert columns.kinds() == {"slip": "bool", "score": "double", "marks": ("list", "double")}
