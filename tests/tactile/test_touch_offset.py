"""The normal force over the squeeze shows how far a touch lies from where it was noticed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.tactile.touch_offset import LEAST_STD_M, MISTAKEN_STD_M, MOST_M, TouchOffset

POWER = 1.25


def expected_mm(beyond_mm, offset_mm, *, power=POWER, factors=None, std_m=LEAST_STD_M, scale=1.0):
    """Feed squeezes beyond the true touch, three frames each; return the offset that is expected (mm)."""
    offset = TouchOffset(POWER)
    for at, squeeze_mm in enumerate(beyond_mm):
        normal_n = scale * squeeze_mm**power * (1.0 if factors is None else factors[at])
        for _ in range(3):
            offset.take(1e-3 * (squeeze_mm + offset_mm), normal_n, std_m)
    return 1e3 * offset.offset_m


@pytest.mark.parametrize("std_m", [LEAST_STD_M, MISTAKEN_STD_M])
@given(offset_mm=st.floats(-1.2, 1.4), scale=st.floats(0.1, 20), first_mm=st.floats(0.3, 1.0))
def test_a_touch_that_is_wrong_by_a_millimetre_is_found(std_m, offset_mm, scale, first_mm):
    beyond_mm = first_mm * 1.6 ** np.arange(5)
    found_mm = expected_mm(beyond_mm, offset_mm, scale=scale, std_m=std_m)
    assert found_mm == pytest.approx(offset_mm, abs=0.45)


def test_the_expected_offset_grows_with_the_true_one():
    # It fell back to 0 where the most probable offset, between a right touch and a wrong one, fits neither well.
    beyond_mm = 1.0 * 1.6 ** np.arange(5)
    found_mm = [expected_mm(beyond_mm, offset_mm) for offset_mm in np.linspace(0.2, 1.4, 13)]
    assert np.all(np.diff(found_mm) >= 0)


@given(power=st.floats(1.0, 1.5), seed=st.integers(0, 999))
def test_a_right_touch_stays_where_it_is_whatever_the_object(power, seed):
    factors = np.exp(np.random.default_rng(seed).normal(0, 0.08, 4))
    assert abs(expected_mm([1.0, 1.3, 1.7, 2.2], 0.0, power=power, factors=factors)) < 0.6


@given(st.lists(st.tuples(st.floats(-1, 20), st.floats(-1, 50)), max_size=40))
def test_it_is_always_a_bounded_number(frames):
    offset = TouchOffset(POWER)
    for squeeze_mm, normal_n in frames:
        assert abs(offset.take(1e-3 * squeeze_mm, normal_n, 1e-4)) <= MOST_M + 1e-12


def test_one_squeeze_shows_no_offset_nor_does_a_frame_without_a_force():
    offset = TouchOffset(POWER)
    for _ in range(9):
        offset.take(1.4e-3, 0.4, LEAST_STD_M)
        offset.take(2.0e-3, math.nan, LEAST_STD_M)
        offset.take(math.nan, 0.4, LEAST_STD_M)
    assert offset.offset_m == 0


@pytest.mark.parametrize("std_m", [LEAST_STD_M, MISTAKEN_STD_M, math.nan])
@pytest.mark.parametrize("beyond_mm", [(1.0, 1.1), (1.0, 1.3), (0.6, 0.7)])
def test_forces_that_fit_the_noticed_touch_leave_it_where_it_is(std_m, beyond_mm):
    assert abs(expected_mm(beyond_mm, 0.0, std_m=std_m)) < 0.06


@pytest.mark.parametrize(("squeeze_mm", "normal_n"), [(0.9, 0.35), (-1.9, 0.05), (-0.3, 0.05), (2.0, 0.3)])
@pytest.mark.parametrize("frames", [1, 3])
def test_one_wrong_force_does_not_move_the_touch(squeeze_mm, normal_n, frames):
    offset = TouchOffset(POWER)
    for beyond_mm in (1.0, 1.3, 1.6, 2.2):
        for _ in range(3):
            offset.take(1e-3 * beyond_mm, beyond_mm**POWER, LEAST_STD_M)
    for _ in range(frames):
        offset.take(1e-3 * squeeze_mm, normal_n, LEAST_STD_M)
    assert abs(offset.offset_m) < 3e-4


def test_a_force_that_does_not_follow_the_squeeze_leaves_the_touch():
    """Foam, and fingers that do not move."""
    offset = TouchOffset(POWER)
    for squeeze_mm in np.linspace(1, 3, 9):
        for _ in range(3):
            offset.take(1e-3 * squeeze_mm, 2.0, LEAST_STD_M)
    assert abs(offset.offset_m) < 5e-4


def test_what_a_light_touch_has_shown_is_kept_in_a_long_grip():
    offset, rng = TouchOffset(POWER), np.random.default_rng(1)
    for beyond_mm in [0.4, 0.6, 1.0, *np.linspace(1.5, 4.4, 30)]:
        for _ in range(3):
            normal_n = beyond_mm**POWER * math.exp(rng.normal(0, 0.05))
            offset.take(1e-3 * (beyond_mm + 1.1), normal_n, LEAST_STD_M)
    assert offset.offset_m == pytest.approx(1.1e-3, abs=3e-4)
