"""The manuals' frames, byte for byte, and framing of arbitrary input."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_mocks.wire.robotiq.rtu import GAP_NS, Deframer, crc

from tests.wire.robotiq.rig import Bench, framed

CLEAR = "09 10 03 E8 00 03 06 00 00 00 00 00 00 73 30"
ACTIVATE = "09 10 03 E8 00 03 06 01 00 00 00 00 00 72 E1"
CLOSE = "09 10 03 E8 00 03 06 09 00 00 FF FF FF 42 29"
OPEN = "09 10 03 E8 00 03 06 09 00 00 00 FF FF 72 19"
WRITTEN = "09 10 03 E8 00 03 01 30"
FIRST_STATUS = "09 03 07 D0 00 01 85 CF"
STATUS_3 = "09 03 07 D0 00 03 04 0E"
STATUS_4 = "09 04 07 D0 00 03 B1 CE"


def test_activation():
    bench = Bench()
    assert bench.ask(CLEAR) == WRITTEN
    assert bench.ask(FIRST_STATUS) == "09 03 02 00 00 59 85"
    assert bench.ask(ACTIVATE) == WRITTEN
    assert bench.ask(FIRST_STATUS) == "09 03 02 11 00 55 D5"
    bench.wait(0.8)
    bench.ask(FIRST_STATUS)
    bench.wait(0.9)
    assert bench.ask(FIRST_STATUS) == "09 03 02 31 00 4C 15"


def test_closing_on_an_object_and_opening():
    # 9.45 mm at count 0xBD, and what 185 N press in.
    bench = Bench(activated=True, open_tick=13, closed_tick=230, object_mm=21.78)
    bench.wait(0.0035, step_s=0.0035)
    assert bench.ask(CLOSE) == WRITTEN
    bench.wait(0.0015, step_s=0.0015)
    assert bench.ask(STATUS_3) == "09 03 06 39 00 00 FF 0E 0A F7 8B"
    bench.wait(0.5)
    assert bench.ask(STATUS_3) == "09 03 06 B9 00 00 FF BD 00 1D 7C"
    assert bench.ask(OPEN) == WRITTEN
    bench.wait(0.5)
    assert bench.ask(STATUS_3) == "09 03 06 F9 00 00 00 0D 00 56 4C"
    assert bench.ask(STATUS_4) == "09 04 06 F9 00 00 00 0D 00 17 AA"


def test_writing_position_speed_and_force_alone():
    bench = Bench(activated=True)
    assert bench.ask("09 10 03 E9 00 02 04 60 E6 3C C8 EC 7C") == "09 10 03 E9 00 02 91 30"
    assert bench.machine.command[:6].hex() == "010060e63cc8"


def test_one_register_and_write_and_read_at_once():
    bench = Bench(activated=True)
    one = framed("09 06 03 E8 09 00")
    assert bench.ask(one) == one
    both = framed("09 17 07 D0 00 03 03 E8 00 03 06 09 00 00 80 FF 00")
    assert bench.ask(both) == framed("09 17 06 39 00 00 80 03 0A")


@pytest.mark.parametrize(
    "request_",
    [
        "08 03 07 D0 00 03",  # another slave
        "09 03 07 CF 00 01",  # before the block
        "09 03 07 D0 00 09",  # beyond its end
        "09 04 07 D0 00 00",  # nothing
        "09 03 03 E8 00 03",  # the command block is write-only
        "09 06 07 D0 00 01",  # the status block is read-only
        "09 10 03 E8 00 03 04 01 00 00 00",  # count and bytes differ
        "09 10 03 EF 00 02 04 01 00 00 00",
        "09 17 07 D0 00 09 03 E8 00 01 02 09 00",
        "09 01 07 D0 00 01",  # functions that it does not know
        "09 2B 0E 01 00",
    ],
)
def test_what_is_not_understood_is_passed_over_in_silence(request_):
    bench = Bench(activated=True)
    assert bench.ask(framed(request_)) == ""
    bench.wait(0.02)
    assert bench.ask(FIRST_STATUS) == "09 03 02 31 00 4C 15"
    assert bench.machine.command[:6] == bytes([1, 0, 0, 0, 0, 0])


def test_a_bad_crc_is_silence_until_the_line_falls_silent():
    bench = Bench()
    assert bench.ask(FIRST_STATUS[:-1] + "E") == ""
    assert bench.ask(FIRST_STATUS) == "", "still part of the damaged frame"
    bench.wait(0.02)
    assert bench.ask(FIRST_STATUS) == "09 03 02 00 00 59 85"


FRAMES = [bytes.fromhex(text) for text in (CLEAR, ACTIVATE, CLOSE, OPEN, FIRST_STATUS, STATUS_3, STATUS_4)]


@given(st.lists(st.binary(max_size=300), max_size=8), st.sampled_from(FRAMES))
def test_after_any_bytes_and_a_pause_a_request_is_found(chunks, frame):
    deframer = Deframer()
    for chunk in chunks:
        for found in deframer.feed(chunk, 1):
            assert crc(found[:-2]) == found[-2:]
    assert deframer.feed(frame, 1 + GAP_NS) == [frame]


@given(st.lists(st.sampled_from(FRAMES), min_size=1, max_size=6), st.data())
def test_requests_are_found_however_they_are_cut(frames, data):
    stream, deframer, found = b"".join(frames), Deframer(), []
    while stream:
        n = data.draw(st.integers(1, len(stream)))
        found += deframer.feed(stream[:n], 1)
        stream = stream[n:]
    assert found == frames


@given(st.sampled_from(FRAMES), st.integers(0, 6 * 8 - 1))
def test_a_flipped_bit_is_never_obeyed(frame, bit):
    bit %= len(frame) * 8
    spoilt = bytearray(frame)
    spoilt[bit // 8] ^= 1 << bit % 8
    assert Deframer().feed(bytes(spoilt), 1) == []
