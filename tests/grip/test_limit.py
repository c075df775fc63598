"""The friction limit: learnt from what slipped and what held; refutes alarms that contradict it."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.grip.limit import CAUGHT_SHARE, KINETIC_SHARE, FrictionLimit

ratios = st.floats(0.01, 100)


def test_nothing_is_known_before_something_slips():
    limit = FrictionLimit()
    limit.holds(0.4, 0.04)
    assert not limit.known
    assert math.isnan(limit.squeeze_m(1.0, 1.25))


@given(ratios, st.lists(ratios, max_size=20))
def test_the_limit_is_the_greatest_ratio_since_the_slip_began(begins, later):
    limit = FrictionLimit()
    limit.slips(begins, sure=True)
    for ratio in later:
        for _ in range(3):
            limit.holds(ratio, 0.04)
    assert limit.limit == max([begins, *later])


@given(ratios, st.floats(1, 100))
def test_one_frame_alone_does_not_raise_the_limit(begins, share):
    limit = FrictionLimit()
    limit.slips(begins, sure=True)
    for ratio in (begins, begins, share * begins, begins, begins):
        limit.holds(ratio, 0.04)
    assert limit.limit == begins


@given(ratios, ratios)
def test_a_later_slip_begins_anew(first, second):
    limit = FrictionLimit()
    limit.slips(first, sure=True)
    limit.holds(0.5 * first, 0.04)
    limit.slips(second, sure=True)
    # What held just before tells of static friction, unless the surface has changed.
    static = KINETIC_SHARE * 0.5 * first < second < 0.5 * first
    # Nor does one frame that shows more than was ever seen.
    assert limit.limit == (0.5 * first if static else min(first, second))


@given(ratios)
def test_a_single_alarm_is_no_limit_and_a_second_one_in_a_row_is(ratio):
    limit = FrictionLimit()
    limit.slips(ratio, sure=False)
    assert not limit.known
    limit.holds(ratio, 0.04)
    limit.slips(ratio, sure=False)
    assert not limit.known
    limit.slips(ratio, sure=False)
    assert limit.limit == ratio


@given(ratios, st.floats(0.1, 10), st.floats(1, 3))
def test_the_squeeze_carries_the_load_with_the_margin_in_any_unit(ratio, load, margin):
    limit = FrictionLimit()
    limit.slips(ratio, sure=True)
    squeeze = limit.squeeze_m(load, margin)
    assert load / squeeze == pytest.approx(ratio / margin)


@given(ratios, st.floats(0.01, 2))
def test_an_alarm_below_what_sliding_friction_carries_is_refuted(held, share):
    limit = FrictionLimit()
    limit.holds(held, 0.04)
    assert limit.refutes(share * held) == (share * held < KINETIC_SHARE * held)


def test_a_slip_that_goes_on_keeps_its_ratio():
    limit = FrictionLimit()
    for ratio in (1.0, 0.8, 0.8):
        limit.slips(ratio, sure=False)
    assert not limit.refutes(0.75)
    assert limit.refutes(0.99 * CAUGHT_SHARE * 0.8)


def test_what_held_is_forgotten():
    limit = FrictionLimit()
    limit.holds(1.0, 0.04)
    for _ in range(250):
        limit.holds(0.1, 0.04)
    assert limit.held == pytest.approx(0.1, abs=0.02)
    assert not limit.refutes(0.3)
