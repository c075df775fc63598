"""A gripper whose closings the gel does not show stops the cell; one whose force follows does not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.contracts import GripEstimate
from lsds.errors import SafetyStop
from lsds.safety.press_watch import LEAST_SHARE, PressWatch

POWER = 1.25
FRAME_NS = 40_000_000
CLOSING = [1.5, 1.5, 1.7, 1.9, 2.1, 2.3, 2.5, 2.5, 2.5, 2.5, 2.5, 2.5]
"""A squeeze that grows by two thirds, mm."""


def feed(watch: PressWatch, squeezes_mm, normals_n, start: int = 0) -> None:
    for at, (squeeze_mm, normal_n) in enumerate(zip(squeezes_mm, normals_n, strict=True)):
        watch.take((start + at) * FRAME_NS, squeeze_mm * 1e-3, normal_n)


def test_a_closing_that_the_gel_does_not_show_stops_the_cell():
    with pytest.raises(
        SafetyStop, match=r"closed by 0\.75 mm, but the normal force .* changed by \+0 % instead of \+66 %"
    ):
        feed(PressWatch(POWER), CLOSING, [2.0] * len(CLOSING))


LAGGING = [
    *((1.444, 4.576), (1.860, 7.065), (1.889, 7.117), (2.333, 7.230), (2.333, 7.627), (3.0, 7.763), (3.0, 8.797)),
    *((3.0, 7.998), (3.0, 8.385), (3.0, 8.123), (3.0, 7.781), (3.0, 8.124), (3.0, 8.771), (3.0, 8.164), (3.0, 9.833)),
    *((2.8, 8.787), (2.778, 8.551), (2.778, 8.155), (2.778, 8.007), (2.778, 7.818), (2.778, 8.481), (2.778, 8.322)),
    *[(2.556, normal_n) for normal_n in (7.593, 7.572, 7.472, 7.330, 7.876, 7.489, 8.107, 7.323, 8.384, 8.340)],
]
"""Squeeze (mm) and normal force (N) of a simulated pipe: the force grows a frame before the reported squeeze."""


def test_a_series_of_closings_is_forgotten_as_a_whole():
    """The rest of it, without its first frame, would be a closing without a response."""
    squeezes_mm, normals_n = zip(*LAGGING, *[LAGGING[-1]] * 40, strict=True)
    feed(PressWatch(POWER), squeezes_mm, normals_n)


def test_closings_that_are_long_over_do_not_count():
    watch = PressWatch(POWER)
    feed(watch, [1.5, *[1.7] * 80, *[1.9] * 80, *[2.1] * 80], [2.0] * 241)
    assert sum(map(len, watch._series)) < 20


def test_an_aperture_that_never_rests_is_not_kept_for_ever():
    watch = PressWatch(POWER)
    squeezes_mm = [2.0 + 0.2 * (at % 2) for at in range(2000)]
    feed(watch, squeezes_mm, [squeeze_mm**POWER for squeeze_mm in squeezes_mm])
    assert sum(map(len, watch._series)) <= 500


@given(share=st.floats(LEAST_SHARE + 0.05, 2), scale=st.floats(0.2, 20))
def test_a_force_that_follows_does_not(share, scale):
    feed(PressWatch(POWER), CLOSING, [scale * squeeze ** (share * POWER) for squeeze in CLOSING])


@given(squeezes=st.lists(st.floats(0.4, 20), min_size=3, max_size=80), scale=st.floats(0.2, 20))
def test_no_sound_gripper_stops_the_cell_however_it_moves(squeezes, scale):
    feed(PressWatch(POWER), squeezes, [scale * squeeze**POWER for squeeze in squeezes])


def test_a_force_that_decays_between_closings_does_not():
    """A sphere that slips along the pad loses force at a constant squeeze."""
    watch, squeeze_mm, normal_n, frame = PressWatch(POWER), 2.0, 5.0, 0
    for _ in range(6):
        squeeze_mm, normal_n = 1.15 * squeeze_mm, normal_n * 1.15**POWER
        for _ in range(8):
            watch.take(frame * FRAME_NS, squeeze_mm * 1e-3, normal_n)
            normal_n *= 0.96
            frame += 1


@pytest.mark.parametrize("flickers_mm", [0.0, 0.02, 0.2])
@pytest.mark.parametrize("noise", [0.0, 0.02, 0.1])
def test_a_resting_aperture_that_flickers_within_a_tick_is_no_closing(flickers_mm, noise):
    rng, watch = np.random.default_rng(3), PressWatch(POWER, 2.2e-4)
    squeezes = 1.5 + (0.222 * rng.integers(0, 2, 900) if flickers_mm == 0.2 else rng.normal(0, flickers_mm, 900))
    feed(watch, squeezes, 2.0 * np.exp(rng.normal(0, noise, 900)))


@pytest.mark.parametrize("lag", [0, 1, 2])
@pytest.mark.parametrize("period", [1, 2, 5])
def test_fingers_that_close_and_open_by_turns_have_not_closed(lag, period):
    squeezes = [2.0 + 0.3 * (at // period % 2) for at in range(300)]
    normals = [squeeze**POWER for squeeze in squeezes]
    feed(PressWatch(POWER), squeezes, normals[:1] * lag + normals[: len(normals) - lag])


@pytest.mark.parametrize("rate_hz", [5, 8, 12, 25, 60])
@pytest.mark.parametrize("every", [1, 3, 8])
def test_a_force_may_follow_later_however_slow_the_camera(rate_hz, every):
    watch, squeeze_mm, before_mm = PressWatch(POWER), 1.0, 1.0
    for at in range(60):
        watch.take(round(at * 1e9 / rate_hz), squeeze_mm * 1e-3, before_mm**POWER)
        before_mm = squeeze_mm
        squeeze_mm *= 1.15 if at % every == 0 and squeeze_mm < 9 else 1.0


def test_a_small_closing_is_not_judged():
    feed(PressWatch(POWER), [1.5, 1.5, 1.7, 1.9, 1.9, 1.9, 1.9, 1.9, 1.9], [2.0] * 9)


def test_a_noisy_force_may_grow_less_by_its_noise():
    rng = np.random.default_rng(4)
    rest = 1.5 * np.ones(40), 2.0 * np.exp(rng.normal(0, 0.2, 40))
    noisy = PressWatch(POWER)
    feed(noisy, *rest)
    feed(noisy, CLOSING, [2.0] * len(CLOSING), start=40)
    calm = PressWatch(POWER)
    feed(calm, rest[0], 2.0 * np.ones(40))
    with pytest.raises(SafetyStop):
        feed(calm, CLOSING, [2.0] * len(CLOSING), start=40)


def test_one_leap_of_the_estimate_is_no_answer_to_a_closing():
    closing = [1.5, 1.7, 1.9, 2.1, 2.3, 2.5, 2.5, 2.5, 2.5, 2.5, 2.6, 2.6, 2.6]
    normals = [squeeze**POWER for squeeze in closing]
    feed(PressWatch(POWER), closing, [*normals[:-3], *(0.4 * normal for normal in normals[-3:])])


def test_frames_without_a_known_force_are_left_out():
    watch = PressWatch(POWER)
    for at, squeeze in enumerate(CLOSING):
        watch.take(at * FRAME_NS, squeeze * 1e-3, math.nan)
        watch.take(at * FRAME_NS, math.nan, 2.0)


@pytest.mark.parametrize(("slips", "reach_m", "judged"), [(0.9, 0.004, False), (0.0, 0.004, True), (0.9, 0.009, True)])
def test_a_short_contact_that_slides_is_not_judged(slips, reach_m, judged):
    watch, stopped = PressWatch(POWER), False
    for at, squeeze_mm in enumerate(CLOSING):
        grip = GripEstimate(t_ns=at * FRAME_NS, slips=slips, reach_m=reach_m, normal_n=2.0)
        try:
            watch.see(grip, 1e-3 * squeeze_mm)
        except SafetyStop:
            stopped = True
    assert stopped is judged


def test_a_new_object_starts_again():
    watch = PressWatch(POWER)
    feed(watch, CLOSING[:5], [2.0] * 5)
    watch.reset()
    feed(watch, CLOSING[4:], [2.0] * (len(CLOSING) - 4), start=5)


def see_late(watch: PressWatch, squeezes_mm, late_mm: float, touch_std_m: float) -> None:
    """Feed a sound gripper whose touch was noticed late, so that the squeeze looks smaller than it is."""
    for at, squeeze_mm in enumerate(squeezes_mm):
        normal_n = (squeeze_mm + late_mm) ** POWER
        watch.see(GripEstimate(t_ns=at * FRAME_NS, normal_n=normal_n), 1e-3 * squeeze_mm, touch_std_m)


@given(squeezes=st.lists(st.floats(0.3, 10), min_size=3, max_size=40), late_mm=st.floats(0, 2))
def test_a_touch_that_was_noticed_late_is_no_fault_of_the_gripper(squeezes, late_mm):
    see_late(PressWatch(POWER), squeezes, late_mm, 1e-3)


def test_a_touch_that_was_noticed_late_must_not_be_called_exact():
    with pytest.raises(SafetyStop):
        see_late(PressWatch(POWER), [0.3] * 20 + [0.9] * 20, 2.0, 0.0)
