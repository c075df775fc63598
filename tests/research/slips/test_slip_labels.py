"""Labels by eye: a file is read back as it was written, and a wrong one is one error that names its lines."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lsds_research.slips.folder import SECOND, SHIPPED, scored_only
from lsds_research.slips.labels import COLUMNS, NAME, Interval, State, name_of, read_labels, states, write_labels

from lsds.errors import DataError

px = st.one_of(st.just(math.nan), st.integers(-99_999, 99_999).map(lambda value: value / 10))
text = st.text(st.characters(exclude_categories=["Cc", "Cs"]) | st.sampled_from(',";\n'), max_size=12).map(str.strip)
names = text.filter(lambda name: name not in ("", ".", "..") and "/" not in name and name_of(Path(name)) == name)


@st.composite
def intervals(draw):
    """Intervals of one recording, from frame 0 on without gaps."""
    found, begin = [], 0
    for length in draw(st.lists(st.integers(1, 400), min_size=1, max_size=6)):
        state, sure = draw(st.sampled_from(State)), draw(st.integers(0, 100)) / 100
        rest = (draw(px), draw(px), draw(px), sure, draw(text), draw(text))
        found.append(Interval(begin, begin + length - 1, state, *rest))
        begin += length
    return found


labels_of_many = st.dictionaries(names, intervals(), max_size=3)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("labels") / NAME


HEADER = ",".join(COLUMNS)


def written(file, *lines, header=HEADER):
    file.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
    return file


@settings(max_examples=60)
@given(labels=labels_of_many)
def test_what_is_written_is_read_back(file, labels):
    write_labels(file, labels)
    # By their text, for in it what is not known equals what is not known.
    assert repr(read_labels(file)) == repr(labels)


@given(own=intervals(), beyond=st.integers(-20, 20))
def test_every_frame_has_the_state_of_its_interval_and_others_are_unsure(own, beyond):
    count = max(1, own[-1].last + 1 + beyond)
    state, sure = states(own, count)
    assert len(state) == len(sure) == count
    for each in own:
        assert (state[each.first : each.last + 1] == each.state).all()
        assert (sure[each.first : each.last + 1] == each.confidence).all()
    assert (state[own[-1].last + 1 :] == State.UNSURE).all()
    assert (sure[own[-1].last + 1 :] == 0).all()
    assert sum(map(len, own)) == own[-1].last + 1


def test_only_four_columns_are_needed_and_they_may_stand_in_any_order(file):
    written(file, "slip,mug.avi,4,0", "STICK , mug.avi, 9,5", header="state,video,last,first")
    first, second = read_labels(file)["mug"]
    assert (first.first, first.last, first.state) == (0, 4, State.SLIP)
    assert math.isnan(first.tx_px)
    assert first.confidence == 1.0
    assert (second.first, second.last, second.state) == (5, 9, State.STICK)


def test_a_file_of_a_spreadsheet_is_read(file):
    text = 'video,first,last,state,confidence,note\r\nvideos/mug.avi,0,9,stick,0.7,"two\r\nlines"\r\n\r\n'
    file.write_bytes(b"\xef\xbb\xbf" + text.encode())
    (own,) = read_labels(file)["mug"]
    assert (own.confidence, own.note) == (0.7, "two\nlines")


@pytest.mark.parametrize(
    ("cell", "name"),
    [
        ("mug.avi", "mug"),
        ("clips/mug.MP4", "mug"),
        ("mug", "mug"),
        ("mug.v2", "mug.v2"),
        ("mug.v2.avi", "mug.v2"),
        ("2024.05.01", "2024.05.01"),
    ],
)
def test_a_recording_is_called_by_its_file_without_the_ending_of_a_video(file, cell, name):
    assert list(read_labels(written(file, f"{cell},0,9,stick"))) == [name]
    assert name_of(Path(cell)) == name


WRONG = [
    ("mug,1,9,stick", "line 2: frames 1 to 9, but mug goes on at 0"),
    ("mug,0,-1,stick", "line 2: last is '-1', not a number from 0 to 1e+07"),
    ("mug,5,4,stick", "line 2: frames 5 to 4"),
    ("mug,0,9.5,stick", "line 2: frames 0 to 9.5"),
    ("mug,,9,stick", "line 2: first is ''"),
    ("mug,0,,stick", "line 2: last is ''"),
    ("mug,0,nan,stick", "line 2: last is 'nan'"),
    ("mug,nan,9,stick", "line 2: first is 'nan'"),
    ("mug,0,inf,stick", "line 2: last is 'inf'"),
    ("mug,0,9,slips", "line 2: state is 'slips', not one of free, stick, slip, touch, unsure"),
    (",0,9,slip", "line 2: video is empty"),
    ("mug,0,9,slip,far", "line 2: tx_px is 'far', not a number from -10000 to 10000"),
    ("mug,0,9,slip,,,,1.5", "line 2: confidence is '1.5', not a number from 0 to 1"),
    ("mug,0,9,slip,,,,nan", "line 2: confidence is 'nan'"),
    ("mug", "line 2: first is ''"),
]


@pytest.mark.parametrize(("line", "message"), WRONG)
def test_a_wrong_line_is_named(file, line, message):
    with pytest.raises(DataError) as caught:
        read_labels(written(file, line))
    assert message in str(caught.value)
    assert str(caught.value).startswith(f"{file}: ")


def test_all_wrong_lines_are_reported_at_once_and_many_are_counted(file):
    with pytest.raises(DataError, match=r"line 3: .*goes on at 5; line 4: state is 'x'") as caught:
        read_labels(written(file, "mug,0,4,stick", "mug,6,9,stick", "can,0,4,x"))
    assert "line 2" not in str(caught.value)
    with pytest.raises(DataError, match=r"line 6: [^;]*; and 3 more$"):
        read_labels(written(file, *["mug,0,4,x"] * 8))


def test_a_file_without_labels_names_what_is_missing(file, tmp_path):
    with pytest.raises(DataError, match=r"no such file \(lsds learn label makes one"):
        read_labels(tmp_path / "nowhere.csv")
    with pytest.raises(DataError, match="columns first, last missing"):
        read_labels(written(file, "mug,stick", header="video,state"))
    with pytest.raises(DataError, match="column state missing"):
        read_labels(written(file, "mug,0,9", header="video,first,last"))
    with pytest.raises(DataError, match="columns video, first, last, state missing"):
        read_labels(written(file, header=""))
    file.write_bytes(b"video,first,last,state\n\xff\xfe,0,9,stick\n")
    with pytest.raises(DataError, match="cannot be read"):
        read_labels(file)
    with pytest.raises(DataError, match="cannot be read"):
        read_labels(tmp_path)


def test_no_labels_are_a_file_with_a_header_alone(file):
    write_labels(file, {})
    assert file.read_text() == ",".join(COLUMNS) + "\n"
    assert read_labels(file) == {}


@pytest.mark.parametrize("shipped", [SHIPPED, SECOND])
def test_the_shipped_labels_are_well_formed(shipped):
    labels = read_labels(shipped)
    assert labels
    for own in labels.values():
        assert own[0].first == 0
        assert all(one.last + 1 == other.first for one, other in pairwise(own))
        assert all(each.labeller for each in own)
        assert all(each.state == State.SLIP or np.isnan([each.tx_px, each.ty_px, each.turn_deg]).all() for each in own)


def test_the_shipped_second_labels_and_scored_objects_are_of_the_first():
    first, second = read_labels(SHIPPED), read_labels(SECOND)
    assert set(second) <= set(first)
    for name in second:
        assert {each.labeller for each in first[name]}.isdisjoint(each.labeller for each in second[name])
    assert scored_only() < {name.split("__")[0] for name in first}
