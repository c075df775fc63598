"""The squeeze grows only with a load that rises beyond the largest carried load."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.grip.options import GripOptions
from lsds.grip.rising_load import RISE_NOISE_N, RisingLoad

FRAME_NS = 40_000_000


def fed(loads, squeeze_m=1e-3, power=1.25, answer_s=0.1):
    rising = RisingLoad(GripOptions(power=power, limit=0.01))
    return rising, [rising.required_m(i * FRAME_NS, load, squeeze_m, answer_s) for i, load in enumerate(loads)]


@given(load_n=st.floats(0.1, 20), power=st.floats(1, 2), seed=st.integers(0, 99))
def test_a_steady_load_requires_nothing(load_n, power, seed):
    noise = np.random.default_rng(seed).uniform(-0.01, 0.01, 200)
    assert set(fed(load_n * (1 + noise), power=power)[1]) == {0.0}


@given(load_n=st.floats(1, 20), power=st.floats(1, 2), growth=st.floats(1.6, 3))
def test_a_load_that_rises_keeps_its_share_of_the_limit(load_n, power, growth):
    ramp = load_n * np.concatenate([np.ones(25), np.linspace(1, growth, 50)])
    _, required = fed(ramp, power=power)
    # At the end of the ramp: the squeeze of before times growth^(1 / power), a little ahead of the load.
    least_m = 1e-3 * growth ** (1 / power)
    assert 0.95 * least_m <= required[-1] <= 1.15 * least_m
    assert np.all(np.diff([m for m in required if m]) > -1e-9)


def test_what_fingers_that_follow_have_carried_stays_the_measure():
    rising = RisingLoad(GripOptions(power=1.0, limit=0.01))
    squeeze_m = 1e-3
    for i, load_n in enumerate(np.concatenate([np.ones(25), np.linspace(1, 2, 75), 2 * np.ones(25)])):
        squeeze_m = max(squeeze_m, rising.required_m(i * FRAME_NS, load_n, squeeze_m, 0.1))
    assert squeeze_m == pytest.approx(2e-3, rel=0.05)


def test_after_a_slip_nothing_is_known_to_be_carried():
    rising, required = fed(np.concatenate([np.ones(25), np.linspace(1, 2, 25)]))
    assert required[-1] > 1.5e-3
    rising.forget()
    assert rising.required_m(10**10, 2.0, 1e-3, 0.1) == 0.0


def test_a_load_that_swings_after_a_slide_does_not_rise():
    """A braked pipe hung at 0.2 N for a frame and at 2 N in the next; the fingers closed from 4 to 24 mm."""
    rising, _ = fed([1.8] * 30)
    rising.forget(30 * FRAME_NS)
    swings = [0.2, 2.1, 1.9, 1.6, *[1.8] * 20]
    assert {rising.required_m((31 + i) * FRAME_NS, load_n, 1e-3, 0.1) for i, load_n in enumerate(swings)} == {0.0}


def test_a_single_noisy_frame_is_bounded():
    _, required = fed([1.0] * 25 + [1.3, 1.0, 1.0])
    assert required[-2:] == [0.0, 0.0]
    assert required[-3] < 1.6e-3


@given(load_n=st.floats(0.03, 1), seed=st.integers(0, 99))
def test_the_noise_of_a_small_load_requires_nothing(load_n, seed):
    noise_n = np.random.default_rng(seed).uniform(-0.4, 0.4, 200) * RISE_NOISE_N
    assert set(fed(load_n + noise_n)[1]) == {0.0}


def test_a_light_object_in_a_firm_grip_is_not_squeezed_beyond_what_the_weakest_need():
    """A marble was squeezed by 24 mm: its load rose with each closing, and had been small in a grip that was firm."""
    options = GripOptions()
    rising = RisingLoad(options)
    ramp = np.concatenate([np.full(10, 0.05), np.linspace(0.05, 0.6, 50)])
    required = [rising.required_m(i * FRAME_NS, load, 5e-3, 0.1) for i, load in enumerate(ramp)]
    weakest = options.limit * np.exp(-2 * options.spread)
    assert 0 < max(required) <= 1e-3 * (0.75 / weakest) ** (1 / options.power)


def test_a_slow_rise_of_a_light_load_counts():
    """A candle that was filled for two seconds lost its grip: it rose by less than the noise in each third of one."""
    _, required = fed(np.concatenate([np.full(25, 0.4), np.linspace(0.4, 0.65, 50)]))
    assert required[-1] >= 0.95e-3 * (0.65 / 0.4) ** (1 / 1.25)


def test_what_a_load_rises_by_while_the_arm_stops_is_not_carried():
    rising, required = RisingLoad(GripOptions(limit=0.01)), []
    ramp = np.concatenate([np.ones(25), np.linspace(1, 2, 75)])
    for i, load_n in enumerate(ramp):
        shaken_n = 0.2 if 50 <= i < 55 else 0.0
        required.append(rising.required_m(i * FRAME_NS, load_n + shaken_n, 1e-3, 0.1, 0.04 if i < 50 else 0.0))
    assert required[-1] >= 0.95e-3 * 2 ** (1 / 1.25)
    assert set(required[50:60]) == {0.0}, "the arm's acceleration is no rise"
