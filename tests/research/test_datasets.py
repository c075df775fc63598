"""A dataset is read back unchanged; any damage gives one clear DataError, and files are written atomically."""

from __future__ import annotations

import errno
import json
import os

import numpy as np
import pyarrow
import pyarrow.parquet as parquet
import pytest
from lsds_research import datasets
from lsds_research.datasets import COLUMNS, FRAMES, KEYS, LABELS, Dataset, from_rows, joined, load

from lsds.errors import DataError
from lsds.models.signals import SIGNALS, UNITS
from lsds.support import files

COUNT = 12


def recording(name="r0", seed=0, count=COUNT):
    rng = np.random.default_rng(seed)
    signals = rng.standard_normal((count, len(SIGNALS))).astype(np.float32)
    signals[0, 3] = np.nan
    labels = {"slip": np.arange(count) % 3 - 1, "speed": rng.random(count)}
    return from_rows(name, "book", "slip", np.arange(count) * 0.04, signals, labels)


@pytest.fixture
def data():
    return joined([recording("r0", 0), recording("r1", 1, 5)], {"rig": {"gel": 7}, "seeds": [1, 2]})


@pytest.fixture
def saved(data, tmp_path):
    data.save(tmp_path / "set")
    return tmp_path / "set"


def refused(folder, match):
    with pytest.raises(DataError, match=match) as caught:
        load(folder)
    assert folder.name in str(caught.value), "it names the place"


def rewritten(folder, **columns):
    """The same file with columns replaced, or left out where None."""
    kept = {**datasets.read_table(folder / FRAMES), **columns}
    table = pyarrow.table({name: pyarrow.array(v) for name, v in kept.items() if v is not None})
    parquet.write_table(table, folder / FRAMES)


def change_card(folder, **changes):
    path = folder / datasets.CARD
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))


def test_a_dataset_comes_back_as_it_was(data, saved):
    back = load(saved)
    assert list(back.columns) == list(COLUMNS) == [*KEYS, *LABELS, *SIGNALS]
    for name, kind in COLUMNS.items():
        assert back[name].dtype == data[name].dtype
        if kind == "str":
            assert back[name].tolist() == data[name].tolist()
        else:
            assert np.array_equal(back[name], data[name], equal_nan=True), name
    assert back.card["rig"] == {"gel": 7}
    assert (back.card["rows"], back.card["recordings"]) == (17, 2)
    assert back.starts.tolist() == [0, 12, 17]
    assert sorted(p.name for p in saved.iterdir()) == ["card.json", "frames.parquet"]


def test_units_are_in_the_file(saved):
    metadata = parquet.read_schema(saved / FRAMES).metadata
    assert {name: metadata[name.encode()].decode() for name in SIGNALS} == UNITS


def test_labels_that_are_not_given_are_unknown():
    columns = recording()
    assert (columns["slip_true"] == -1).all()
    assert np.isnan(columns["speed_true"]).all()


def test_rows_and_signals_are_chosen_by_name(data):
    few = data.where(data["recording"] == "r1")
    assert len(few) == 5
    assert few.card == data.card
    pair = data.signals(["area", "v_net"])
    assert pair.dtype == np.float32
    assert np.array_equal(pair[:, 1], data["v_net"], equal_nan=True)
    with pytest.raises(DataError, match="no column 'speedo'; it has recording, object"):
        data["speedo"]
    with pytest.raises(DataError, match="no column 'nope'"):
        data.signals(["v_net", "nope"])


def test_no_recordings_are_no_dataset():
    with pytest.raises(DataError, match="nothing to make a dataset of"):
        joined([], {})


def test_a_folder_that_is_no_dataset(tmp_path, saved):
    refused(tmp_path / "nowhere", r"no dataset there, for it has no card\.json \(lsds learn collect")
    (saved / datasets.CARD).unlink()
    refused(saved, "no dataset there")


@pytest.mark.parametrize("text", ["", "{", "[]", '{"format": "something else"}', "3"])
def test_a_card_that_is_none(saved, text):
    (saved / datasets.CARD).write_text(text)
    refused(saved, "not (a dataset's card|the card of)")


def test_a_collection_that_was_not_finished(saved):
    change_card(saved, complete=False)
    refused(saved, r"was not finished \(go on: lsds learn collect, same --out\)")


def test_frames_that_are_missing_or_damaged(saved):
    path = saved / FRAMES
    content = path.read_bytes()
    path.unlink()
    refused(saved, "cannot be read as Parquet")
    for broken in (b"", content[: len(content) // 2], content[:-1], b"PAR1" + b"x" * 100 + b"PAR1", b"a,b\n1,2\n"):
        path.write_bytes(broken)
        refused(saved, "cannot be read as Parquet")


def test_bytes_flipped_inside_are_an_error_or_change_nothing_else(saved, data):
    path = saved / FRAMES
    content = path.read_bytes()
    for at in range(4, len(content), max(1, len(content) // 60)):
        flipped = bytearray(content)
        flipped[at] ^= 0xFF
        path.write_bytes(flipped)
        try:
            back = load(saved)
        except DataError:
            continue
        assert list(back.columns) == list(COLUMNS)
        assert len(back) == len(data)


def test_fewer_rows_than_on_the_card(saved):
    columns = datasets.read_table(saved / FRAMES)
    datasets.write_table({name: values[:-3] for name, values in columns.items()}, saved / FRAMES)
    refused(saved, "14 rows, but its card says 17: it was cut short")


@pytest.mark.parametrize("name", ["recording", "t_s", "slip", "speed_true", "v_net", "dt"])
def test_a_missing_column(saved, name):
    rewritten(saved, **{name: None})
    refused(saved, f"column {name} missing")


def test_several_missing_columns_are_reported_at_once(saved):
    rewritten(saved, v_net=None, area=None)
    refused(saved, "columns v_net, area missing")


@pytest.mark.parametrize(
    ("column", "values", "match"),
    [
        ("t_s", np.r_[np.arange(16.0), np.nan], "t_s is not finite in row 16"),
        ("t_s", np.r_[np.inf, np.arange(16.0)], "t_s is not finite in row 0"),
        ("t_s", np.r_[0.0, 0.2, 0.1, np.arange(3, 17.0)], "t_s goes back in row 2"),
        ("slip", np.full(17, 2, np.int8), "column slip holds something else than 1"),
        ("slip_true", np.full(17, -2, np.int8), "column slip_true holds something else"),
        ("area", np.array(["a"] * 17), "column area holds"),
        ("recording", np.arange(17), "column recording holds"),
        ("recording", np.array(["r0", "r1"] * 8 + ["r0"]), "rows of a recording are not together"),
    ],
)
def test_a_column_with_nonsense(saved, column, values, match):
    rewritten(saved, **{column: values})
    refused(saved, match)


@pytest.mark.parametrize(
    ("column", "values"),
    [
        ("frame", pyarrow.array([None, *range(16)], pyarrow.int32())),
        ("object", pyarrow.array([None] + ["book"] * 16)),
        ("v_net", pyarrow.array([None] + [0.1] * 16, pyarrow.float32())),
    ],
)
def test_a_column_with_holes(saved, column, values):
    rewritten(saved, **{column: values})
    refused(saved, f"column {column} has holes")


def test_another_unit(saved):
    table = parquet.read_table(saved / FRAMES)
    metadata = {**table.schema.metadata, b"v_net": b"px/s"}
    parquet.write_table(table.replace_schema_metadata(metadata), saved / FRAMES)
    refused(saved, "column v_net is in px/s, not in m/s")


def test_a_full_disk_leaves_what_was_there_and_no_litter(saved, data, monkeypatch):
    before = {p.name: p.read_bytes() for p in saved.iterdir()}

    def full(*args, **kwargs):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    class Full:
        def __init__(self, file):
            self._file, self.name = file, file.name

        def __enter__(self):
            return self

        def __exit__(self, *error):
            self._file.close()

        write = full

    real = files.NamedTemporaryFile
    monkeypatch.setattr(files, "NamedTemporaryFile", lambda **options: Full(real(**options)))
    with pytest.raises(DataError, match=r"frames\.parquet: cannot be written: No space left .* are kept") as caught:
        data.save(saved)
    assert isinstance(caught.value.__cause__, OSError)
    assert {p.name: p.read_bytes() for p in saved.iterdir()} == before


def test_a_folder_that_cannot_be_made(tmp_path, data):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(DataError, match="cannot be written"):
        data.save(tmp_path / "file" / "set")


def test_an_empty_dataset_has_no_recordings():
    empty = Dataset({name: values[:0] for name, values in recording().items()})
    assert len(empty) == 0
    assert empty.starts.tolist() == [0]
