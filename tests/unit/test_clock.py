from __future__ import annotations

import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.clock import Clock, VirtualClock, WallClock, nanoseconds, seconds


def test_both_clocks_are_clocks():
    assert isinstance(VirtualClock(), Clock)
    assert isinstance(WallClock(), Clock)


def test_virtual_time_stands_still_until_a_sleep():
    clock = VirtualClock(5)
    assert clock.now() == 5
    clock.sleep_until(1_000)
    assert clock.now() == 1_000
    clock.sleep_until(10)
    assert clock.now() == 1_000


def test_wall_clock_sleeps_to_the_deadline_and_not_at_all_for_the_past():
    clock = WallClock()
    before = time.monotonic_ns()
    clock.sleep_until(before + 5_000_000)
    assert time.monotonic_ns() - before >= 5_000_000
    before = time.monotonic_ns()
    clock.sleep_until(before - 1_000_000_000)
    assert time.monotonic_ns() - before < 50_000_000


@given(st.integers(-(10**15), 10**15))
def test_microseconds_survive_the_way_through_seconds(us):
    assert nanoseconds(seconds(us * 1000)) == pytest.approx(us * 1000, abs=200)


def test_rounding_is_to_nearest():
    assert nanoseconds(1 / 60) == 16_666_667
