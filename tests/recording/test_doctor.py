"""A recording passes the checks of the command `mcap doctor`, and so does the part of one that was cut off."""

from __future__ import annotations

import pytest

from tests.recording.doctor import Doctor, examined


def test_a_whole_recording_has_no_problem(recorded):
    found = examined(recorded[0])
    assert (found.problems, found.cut_off) == ([], "")


def test_a_file_that_was_cut_off_has_no_problem_but_its_end(recorded):
    data = recorded[0].read_bytes()
    for part in (3, 5, 7, 9):
        found = Doctor(data[: len(data) * part // 10])
        assert found.problems == []
        assert found.cut_off


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8])
def test_a_changed_byte_is_found(recorded, share):
    data = bytearray(recorded[0].read_bytes())
    data[int(share * len(data))] ^= 0x20
    found = Doctor(bytes(data))
    assert found.problems or found.cut_off
