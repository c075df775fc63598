"""Touch: found by the light on the gel, placed between frame and gripper samples."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lsds.contracts import Frame, GripperState, Situation
from lsds.tactile.touch import TouchFinder, TouchSense, aperture_at

MS = 1_000_000


def image(seed, *, pressed=0.0, gain=1.0):
    """A gel of some light, with the camera's noise; `pressed` levels of a fixed relief."""
    y, x = np.mgrid[0:240, 0:320]
    light = 110 + 30 * np.sin(x / 90) + 20 * np.cos(y / 70)
    relief = np.random.default_rng(99).normal(0, 1, (24, 32)).repeat(10, 0).repeat(10, 1)
    noise = np.random.default_rng(seed).normal(0, 2, (240, 320, 3))
    return np.clip(gain * (light + pressed * relief)[:, :, None] + noise, 0, 255).astype(np.uint8)


def frame(seed, **more):
    return Frame(image(seed, **more), seed * 40 * MS, seed)


def test_a_faint_relief_is_a_touch_and_noise_is_none():
    sense = TouchSense()
    assert not any(sense.update(frame(seed)) for seed in range(200))
    assert sense.update(frame(500, pressed=0.7))


def test_a_relief_below_the_noise_of_one_frame_is_found_in_four():
    sense = TouchSense()
    assert not any(sense.update(frame(seed)) for seed in range(120))
    touched = [sense.update(frame(seed, pressed=0.1)) for seed in range(500, 508)]
    assert not all(touched[:3])
    assert all(touched[3:])


def test_frames_that_the_camera_sends_twice_are_no_touch():
    sense = TouchSense()
    touched = []
    for seed in range(200):
        now = image(seed)
        if seed % 3:
            now[: 80 * (seed % 3)] = image(seed - 1)[: 80 * (seed % 3)]
        touched.append(sense.update(Frame(now, seed * 40 * MS, seed)))
    assert not any(touched)


@pytest.mark.parametrize("apart", [2, 3])
def test_two_frames_with_the_same_noise_are_no_touch(apart):
    sense = TouchSense()
    touched = []
    for seed in range(200):
        now = image(seed)
        if seed == 100 + apart:
            now[:60] = image(100)[:60]
        touched.append(sense.update(Frame(now, seed * 40 * MS, seed)))
    assert not any(touched)


def test_the_pairs_do_not_reach_back_before_the_fingers_opened():
    sense = TouchSense()
    for seed in range(100):
        sense.update(frame(seed))
    touched = [sense.update(frame(seed, pressed=3.0)) for seed in range(500, 504)]
    assert all(touched)
    sense.forget()
    assert not any(sense.update(frame(seed)) for seed in range(600, 610))


def test_a_lamp_that_swings_is_no_touch():
    sense = TouchSense()
    swing = 1 + 0.02 * np.sin(np.arange(120) / 5)
    assert not any(sense.update(frame(seed, gain=float(gain))) for seed, gain in enumerate(swing))


def test_a_touch_that_grows_slowly_does_not_become_what_the_gel_looks_like():
    sense = TouchSense()
    for seed in range(40):
        sense.update(frame(seed))
    touched = [sense.update(frame(100 + k, pressed=0.06 * k)) for k in range(25)]
    assert touched[-1]
    assert all(touched[touched.index(True) :])


def test_a_touch_under_fingers_that_close_tick_by_tick_does_not_become_what_the_gel_looks_like():
    finder = TouchFinder(["left"], 0)
    for step in range(160):
        # Ten frames at each tick of 0.22 mm: within eight frames a faint relief hardly grows.
        closed_mm = 0.22 * max(step // 10 - 4, 0)
        own = Frame(image(step, pressed=0.08 * max(closed_mm - 0.6, 0.0)), step * 40 * MS, step)
        finder.see(situation(step * 40 * MS, 0.02 - 1e-3 * closed_mm, [("left", own)]))
    assert finder.touching


def test_a_light_that_drifts_before_the_fingers_close_is_learnt():
    finder = TouchFinder(["left"], 0)
    for step in range(400):
        own = Frame(image(step, pressed=0.002 * step), step * 40 * MS, step)
        finder.see(situation(step * 40 * MS, 0.02, [("left", own)]))
        assert not finder.touching


def test_there_is_no_touch_before_the_gel_is_known():
    assert not TouchSense().update(frame(1, pressed=20.0))


@given(st.floats(0, 0.05), st.floats(0, 0.05), st.floats(0, 1))
def test_an_aperture_between_two_states_is_interpolated(first, second, share):
    known = [(0, first), (1000, second)]
    assert aperture_at(known, round(1000 * share)) == pytest.approx(first + (second - first) * share, abs=1e-4)
    assert aperture_at(known, 5000) == second
    assert aperture_at(known, -5) == first
    assert math.isnan(aperture_at([], 3))


def situation(t_ns, aperture_m, fingers=()):
    state = GripperState(t_ns, 0, aperture_m, 0.0, moving=True)
    seen = tuple(SimpleNamespace(finger=name, frame=own) for name, own in fingers)
    return Situation(t_ns, gripper=state, fingers=seen)


def closing(finder, touches_mm, names=("left", "right"), speed_mm_s=8.0):
    """Fingers that close from 20 mm at a speed, with frames that are 60 ms old; each finger touches at its aperture."""
    for step in range(400):
        t_ns = step * 8 * MS
        fingers = []
        if step % 5 == 0:
            then_mm = 20 - speed_mm_s * max(t_ns - 60 * MS, 0) * 1e-9
            for name in names:
                deep = max(0.0, touches_mm.get(name, -100.0) - then_mm)
                own = Frame(image(step, pressed=4 * deep), t_ns - 60 * MS, step)
                fingers.append((name, own))
        finder.see(situation(t_ns, (20 - speed_mm_s * t_ns * 1e-9) * 1e-3, fingers))


def test_a_flicker_in_one_frame_does_not_move_the_touch():
    finder = TouchFinder(["left"], 0)
    flickers = {70}
    for step in range(400):
        t_ns = step * 8 * MS
        fingers = []
        if step % 5 == 0:
            then_mm = 20 - 8.0 * max(t_ns - 60 * MS, 0) * 1e-9
            deep = 5.0 if step in flickers else max(0.0, 9.0 - then_mm)
            fingers.append(("left", Frame(image(step, pressed=4 * deep), t_ns - 60 * MS, step)))
        finder.see(situation(t_ns, (20 - 8.0 * t_ns * 1e-9) * 1e-3, fingers))
        if step == 71:
            assert finder.touch_m > 0.015
    assert finder.touch_m == pytest.approx(0.009, abs=0.0005)


def test_a_gel_that_is_free_at_a_smaller_aperture_was_not_touched_before():
    """Two frames of a false alarm, one frame that shows the free gel, and then the object: on two of a thousand gels
    the squeeze was counted from the false alarm, and the object stayed on the table."""
    finder = TouchFinder(["left"], 0)
    deep = [0.0] * 30 + [5.0, 5.0, 0.0, 3.0, 3.0, 3.0]
    for step, pressed in enumerate(deep):
        closed_mm = 0.4 * max(step - 25, 0)
        own = Frame(image(step, pressed=pressed), step * 40 * MS, step)
        finder.see(situation(step * 40 * MS, 0.02 - 1e-3 * closed_mm, [("left", own)]))
        if step == 31:
            assert finder.touch_m == pytest.approx(0.0182, abs=1e-4)
    assert finder.touch_m == pytest.approx(0.017, abs=1e-4)


def test_fingers_that_open_again_do_not_undo_the_touch_at_once():
    finder = TouchFinder(["left"], 0)
    for step, pressed in enumerate([0.0] * 30 + [5.0, 5.0, 0.0]):
        closed_mm = 0.4 * max(step - 25, 0) if step < 32 else 0.0
        own = Frame(image(step, pressed=pressed), step * 40 * MS, step)
        finder.see(situation(step * 40 * MS, 0.02 - 1e-3 * closed_mm, [("left", own)]))
    assert finder.touch_m == pytest.approx(0.0182, abs=1e-4)


def test_the_touch_is_placed_between_frame_and_gripper_samples():
    finder = TouchFinder(["left", "right"], 0)
    closing(finder, {"left": 9.0, "right": 9.0})
    assert finder.touching
    assert not finder.apart
    assert finder.touch_m == pytest.approx(9e-3, abs=4e-4)
    assert finder.std_m == pytest.approx(0.32e-3 / math.sqrt(12), rel=0.2)


def test_a_finger_that_does_not_touch_is_named():
    finder = TouchFinder(["left", "right"], 0)
    closing(finder, {"left": 9.0})
    assert finder.apart == ("right",)


def test_a_finger_that_shows_nothing_is_missed():
    finder = TouchFinder(["left", "right"], 0)
    closing(finder, {"left": 9.0}, names=("left",))
    assert finder.frames == 0
    assert finder.apart == ("right",)
    assert finder.silent_s(400 * 8 * MS) == (pytest.approx(3.2), "right")


def test_a_camera_that_is_frozen_shows_nothing_new():
    finder = TouchFinder(["left"], 0)
    for step in range(60):
        finder.see(situation(step * 40 * MS, 0.02, [("left", Frame(image(min(step, 30)), step * 40 * MS, step))]))
    assert finder.frames == 31
    assert finder.silent_s(60 * 40 * MS) == (pytest.approx(1.2), "left")


def test_a_camera_without_noise_is_not_taken_for_a_frozen_one():
    sense = TouchSense()
    assert not any(sense.update(frame(1)) or sense.frozen for _ in range(60))
    assert sense.update(frame(1, pressed=20.0))


def test_the_last_finger_to_touch_counts():
    finder = TouchFinder(["left", "right"], 0)
    closing(finder, {"left": 10.0, "right": 7.0})
    assert finder.touch_m == pytest.approx(7e-3, abs=4e-4)
