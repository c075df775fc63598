"""Pictures for labelling: in coordinates fixed to the gel, an object that sticks stays in place; one that slides
moves."""

from __future__ import annotations

import math
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from lsds_research.slips.pictures import IN_A_ROW, TILE_PX, _relief_tile, kymograph, strip
from lsds_research.slips.recording_view import GelStep, RecordingView
from research.slips.slid import COUNT, FIRST, LAST, SLIDE, STICK, TRAVEL_PX
from tactile.imprinted import Motion, bumps, painted

from lsds.errors import DataError


def shift_px(seen, one, other):
    """How far one relief is shifted against another, px of the image."""
    size = one.shape[1], one.shape[0]
    (x, y), _ = cv2.phaseCorrelate(one.astype(float), other.astype(float), cv2.createHanningWindow(size, cv2.CV_64F))
    return x * seen.scale, y * seen.scale


def test_a_recording_has_all_its_frames_and_the_motion_of_its_dots(seen):
    own = seen[STICK]
    assert (own.name, len(own), own.images.shape) == (STICK, COUNT, (COUNT, 240, 320, 3))
    assert len(own.relief) == len(own.gel) == len(own.dots) == COUNT
    # The load moves the gel by 1.5 px in x and by half of that in y.
    assert own.moved_px[10:] == pytest.approx(math.hypot(1.5, 0.75), abs=0.15)
    assert own.moved_px[2:10].max() < 0.1
    assert seen[SLIDE].moved_px.max() < 0.1


def test_what_is_carried_by_the_gel_stays_and_what_slides_goes_as_far_as_it_slides(seen):
    for name, by in ((STICK, (0.0, 0.0)), (SLIDE, (TRAVEL_PX, 0.0))):
        own = seen[name]
        reliefs, steps = own.gel_fixed(FIRST - 1, LAST, own.centre(0, COUNT - 1))
        assert len(reliefs) == len(steps) == LAST - FIRST + 2
        assert shift_px(own, reliefs[0], reliefs[-1]) == pytest.approx(by, abs=1.5)
    # At the height of the load the image itself has moved.
    own = seen[STICK]
    assert shift_px(own, own.relief[9], own.relief[14]) == pytest.approx((7.5, -3.75), abs=1.0)


def test_the_gel_s_steps_are_measured_and_the_first_is_none(seen):
    own = seen[STICK]
    _, steps = own.gel_fixed(9, 16, own.centre(0, COUNT - 1))
    assert steps[0] == (0.0, 0.0, 0.0)
    measured = np.array(steps[1:])
    assert measured[:5] == pytest.approx(np.tile([1.5, -0.75, 0.0], (5, 1)), abs=0.1)
    assert measured[5:] == pytest.approx(np.tile([-1.5, 0.75, 0.0], (2, 1)), abs=0.1)


def test_a_gel_that_turns_and_then_shifts_carries_the_view_along(tmp_path):
    depth = bumps()
    for number in range(12):
        turn, shift = np.clip(number - 1, 0, 5), np.clip(number - 6, 0, 5)
        both = Motion(4.0 * shift, 0.0, math.radians(2.0 * turn))
        image = painted(depth, both, both, seq=number).image
        cv2.imwrite(str(tmp_path / f"{number:02}.png"), image[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 1])
    own = RecordingView(tmp_path)
    # Away from the centre of the turn, so that the place itself is carried along.
    reliefs, steps = own.gel_fixed(1, 11, (110.0, 50.0))
    assert [math.degrees(step.turn) for step in steps[1:]] == pytest.approx([2.0] * 5 + [0.0] * 5, abs=0.2)

    def alike(one, other):
        return np.corrcoef(one.ravel(), other.ravel())[0, 1]

    assert alike(own.relief[1], own.relief[11]) < 0.5
    assert alike(reliefs[0], reliefs[-1]) > 0.75
    assert shift_px(own, reliefs[0], reliefs[-1]) == pytest.approx((0, 0), abs=0.7)


def test_where_the_dots_are_not_known_the_step_is_unknown_and_the_view_goes_on(seen, monkeypatch):
    own = seen[STICK]
    monkeypatch.setattr(own, "gel", [None if number == 12 else gel for number, gel in enumerate(own.gel)])
    reliefs, steps = own.gel_fixed(9, 14, (80.0, 60.0))
    assert [math.isnan(step.x) for step in steps] == [False, False, False, True, False, False]
    assert np.isfinite(reliefs).all()
    for picture in (strip(own, 9, 14), kymograph(own)):
        assert picture.dtype == np.uint8


def test_what_moves_is_worth_a_look(seen):
    assert seen[SLIDE].moving() == [(FIRST - 3, LAST + 3)]
    assert seen[STICK].moving() == [(10 - 3, COUNT - 1)]


def test_the_centre_is_where_the_imprint_is(seen):
    own = seen[SLIDE]
    before, after = own.centre(0, FIRST - 1), own.centre(LAST, COUNT - 1)
    assert (after[0] - before[0]) * own.scale == pytest.approx(TRAVEL_PX, abs=9)
    assert (after[1] - before[1]) * own.scale == pytest.approx(0, abs=3)


def test_a_strip_has_a_tile_for_every_frame_image_above_relief(seen):
    own = seen[SLIDE]
    picture = strip(own, 5, 14)
    assert picture.shape == (2 * 2 * TILE_PX[1], IN_A_ROW * TILE_PX[0], 3)
    assert picture.dtype == np.uint8
    # Ten frames: the second row has two, and black.
    below = picture[2 * TILE_PX[1] :]
    assert not below[:, 2 * TILE_PX[0] :].any()
    assert below[:, : 2 * TILE_PX[0]].any()
    image = cv2.resize(own.images[5], TILE_PX, interpolation=cv2.INTER_AREA)
    tile = picture[: TILE_PX[1], : TILE_PX[0]]
    assert (tile == image).all(axis=-1).mean() > 0.95, "all but the number and the lines of the dots"
    small = strip(own, 5, 6, size=(100, 75), across=2)
    assert small.shape == (150, 200, 3)


@pytest.mark.parametrize("shape", [(240, 240), (320, 240)])
def test_square_and_upright_images_have_tiles_too(shape):
    images = np.zeros((1, *shape, 3), np.uint8)
    step = GelStep(0.0, 0.0, 0.0)
    tile = _relief_tile(SimpleNamespace(images=images), np.zeros(shape, np.float32), step, TILE_PX)
    assert tile.shape[:2] == TILE_PX[::-1]


def test_in_the_kymograph_what_sticks_runs_straight(seen):
    """Rows of the first band hardly change over the time of the stick, and do over that of the slide."""

    def changed(name):
        picture = kymograph(seen[name])
        wide = picture.shape[1] // COUNT
        assert picture.shape[1] == COUNT * wide
        columns = picture[20 : 2 * seen[name].relief.shape[2], wide // 2 :: wide, 0].astype(float)
        return np.abs(np.diff(columns[:, FIRST - 1 : LAST + 1], axis=1)).mean()

    assert changed(SLIDE) > 3 * changed(STICK)


def test_the_traces_below_show_the_gel_s_motion(seen):
    blue, stick, slide = (0, 0, 255), kymograph(seen[STICK]), kymograph(seen[SLIDE])
    heights = []
    for picture in (stick, slide):
        rows, _ = np.nonzero((picture[-150:] == blue).all(axis=-1))
        heights.append(np.ptp(rows))
    assert heights[0] > heights[1] + 15


def test_a_recording_of_two_frames_can_be_drawn_and_one_of_one_cannot(recordings, tmp_path):
    for number in (0, 1):
        (tmp_path / f"{number:03}.png").hardlink_to(recordings / SLIDE / f"{number:03}.png")
        if number == 0:
            with pytest.raises(DataError, match="1 frames, but no motion could be tracked"):
                RecordingView(tmp_path)
    own = RecordingView(tmp_path)
    assert own.name == tmp_path.name
    assert kymograph(own).shape[1] == 2 * 8
    assert strip(own, 0, 1).any()


def test_what_cannot_be_followed_is_one_error_that_names_it(tmp_path):
    for number in range(3):
        image = np.random.default_rng(number).integers(90, 110, (240, 320, 3), np.uint8)
        cv2.imwrite(str(tmp_path / f"{number}.png"), image)
    with pytest.raises(DataError, match=str(tmp_path)):
        RecordingView(tmp_path)


def test_a_larger_recording_is_shown_in_the_size_in_which_its_gel_is_followed(recordings, seen, tmp_path):
    for picture in sorted((recordings / STICK).iterdir()):
        image = cv2.imread(str(picture))
        cv2.imwrite(str(tmp_path / picture.name), cv2.resize(image, None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST))
    own = RecordingView(tmp_path)
    assert np.array_equal(own.images, seen[STICK].images)
    assert own.moved_px == pytest.approx(seen[STICK].moved_px, abs=1e-6)
