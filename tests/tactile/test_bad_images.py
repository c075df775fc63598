"""Bad images are not slip: the imprint's detectors abstain or the gate refuses them, and detection resumes after."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from tactile.watched_cell import FIRM_M, GRIPS_S, LOOSE_M, recorded, watched

from lsds.runtime.finger_pipeline import LEAP_FRAMES

BOTH = pytest.mark.parametrize("backend", ["imprint", "fused"])
Fault = Callable[[np.ndarray], np.ndarray]
BEGINS, ENDS = 14, 9
"""Frames before the end of the recording at which the fault begins and ends; the load is constant long before."""


def held() -> list[np.ndarray]:
    return recorded(1.9, FIRM_M).images


def blurred(sigma_px: float) -> Fault:
    return lambda image: cv2.GaussianBlur(image, (0, 0), sigma_px)


def saturated(share: float) -> Fault:
    def fault(image: np.ndarray) -> np.ndarray:
        shown = image.copy()
        shown[: int(share * len(shown))] = 255
        return shown

    return fault


def brighter(gain: float) -> Fault:
    return lambda image: np.clip(image * gain, 0, 255).astype(np.uint8)


def without(colour: int) -> Fault:
    return lambda image: image * np.array([k != colour for k in range(3)], np.uint8)


UNSEEN = {
    "blurred by 8 px": blurred(8.0),
    "blurred by 4 px": blurred(4.0),
    "three fifths saturated": saturated(0.6),
    "over-exposed": brighter(2.0),
    "no red": without(0),
    "no green": without(1),
    "no blue": without(2),
}
"""Faults that hide the imprint."""
HARMLESS = {"a fifth saturated": saturated(0.2), "brighter": brighter(1.3), "darker": brighter(0.6)}


# -- while an object is held -------------------------------------------------------------------------------


@BOTH
@pytest.mark.parametrize("name", UNSEEN)
def test_what_cannot_be_seen_is_not_called_anything(tmp_path, backend, name):
    images, fault = held(), UNSEEN[name]
    answers = watched(
        tmp_path / "clip", [*images[:-BEGINS], *map(fault, images[-BEGINS:-ENDS]), *images[-ENDS:]], backend
    )
    assert np.isnan(answers.slip[-BEGINS:-ENDS]).all()
    assert not (answers.slip[-ENDS:] == 1).any()
    # The first good frame follows a bad one, and a second may be needed to find the markers.
    assert (answers.slip[2 - ENDS :] == 0).all()
    assert not answers.abstains[2 - ENDS :].any()
    if backend == "imprint":
        assert answers.abstains[-BEGINS:-ENDS].all()


@BOTH
@pytest.mark.parametrize("name", HARMLESS)
def test_what_hides_little_raises_no_alarm(tmp_path, backend, name):
    images, fault = held(), HARMLESS[name]
    answers = watched(
        tmp_path / "clip", [*images[:-BEGINS], *map(fault, images[-BEGINS:-ENDS]), *images[-ENDS:]], backend
    )
    assert not (answers.slip[-BEGINS:] == 1).any()
    assert not answers.abstains[2 - ENDS :].any()


def test_a_slip_is_still_seen_beside_what_is_saturated(tmp_path):
    clip = recorded(1.6, LOOSE_M)
    answers = watched(tmp_path / "clip", [saturated(0.2)(image) for image in clip.images], "fused")
    slips = clip.speed_m_s > 0.01
    assert np.mean(answers.slip[slips] == 1) > 0.9


@pytest.mark.parametrize("colour", range(3))
def test_a_recording_without_a_colour_is_refused_and_the_colour_named(tmp_path, colour):
    answers = watched(tmp_path / "clip", list(map(without(colour), held()[:4])), "fused")
    refusals = answers.engine.lines[0].gate.refusals
    assert len(refusals) == 4
    assert ("red", "green", "blue")[colour] in refusals[0].reason


# -- while nothing touches the gel -------------------------------------------------------------------------


@BOTH
@pytest.mark.parametrize(("rate_hz", "pad"), [(25.0, "7x9"), (60.0, "8x10")])
def test_an_untouched_gel_never_slips(tmp_path, backend, rate_hz, pad):
    answers = watched(tmp_path / "clip", recorded(0.8, None, rate_hz, pad).images, backend, rate_hz)
    assert not (answers.slip == 1).any()


@BOTH
@pytest.mark.parametrize("gain", [0.4, 0.65])
def test_a_dim_start_raises_no_alarm_and_does_not_stay_the_reference(tmp_path, backend, gain):
    images, touched = held(), round(25 * (GRIPS_S - 0.15))
    dim = 4
    answers = watched(tmp_path / "clip", [*map(brighter(gain), images[:dim]), *images[dim:]], backend)
    assert not (answers.slip[:touched] == 1).any()
    assert not (answers.slip[-BEGINS:] == 1).any()
    # The reference is renewed if the start is too dim; a slightly dim start does no harm.
    assert answers.engine.lines[0].renewed == ([dim] if gain < 1 / 1.6 else [])
    shown = answers.engine.perception.reference_frame.image.mean()
    assert shown == pytest.approx(images[0].mean() * (1 if gain < 1 / 1.6 else gain), rel=0.02)


@BOTH
def test_first_frames_of_another_state_are_noticed_and_mended(tmp_path, backend):
    images, other = held(), 3
    # An offset of half a pitch along both axes: the markers' identities are ambiguous.
    leapt = [np.roll(image, (16, 16), (0, 1)) for image in images[-other:]]
    untouched = recorded(0.9, None).images
    answers = watched(tmp_path / "clip", [*leapt, *untouched, *images], backend)
    line = answers.engine.lines[0]
    assert line.renewed == [other + LEAP_FRAMES]
    assert line.newest.tracks.valid.mean() > 0.95
    assert not (answers.slip[: other + len(untouched)] == 1).any()
    assert not (answers.slip[-BEGINS:] == 1).any()


@BOTH
def test_a_gel_that_was_pressed_at_first_raises_no_alarm_once_it_is_free(tmp_path, backend):
    """A contact that vanishes within a frame may be called slip; its remainder in the reference may not."""
    pressed, free = held()[-3:], recorded(0.9, None).images
    answers = watched(tmp_path / "clip", [*pressed, *free], backend)
    assert not (answers.slip[len(pressed) + 3 :] == 1).any()
