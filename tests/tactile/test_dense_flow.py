"""Tracker `dis` on a gel without dots: a random texture moved by known amounts."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from lsds_plugins.trackers.dis import DenseFlowOptions, DenseFlowTracker
from tactile.render import HEIGHT, WIDTH, background
from tactile.scenes import frame

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext, TrackFlag
from lsds.errors import DataError


def speckle(sigma, seed):
    """Smooth random grey levels of unit deviation."""
    rough = np.random.default_rng(seed).standard_normal((HEIGHT, WIDTH)).astype(np.float32)
    smooth = cv2.GaussianBlur(rough, (0, 0), sigma)
    return smooth / smooth.std()


TEXTURE = 9 * speckle(3.0, 0) + 9 * speckle(8.0, 1)


def textured(shift=(0.0, 0.0), weight=None, seed=None, gain=1.0):
    """The texture moved by `shift` px, everywhere or by `weight` (h, w) of it; the light stays where it is."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float32)
    w = 1.0 if weight is None else weight.astype(np.float32)
    moved = cv2.remap(
        TEXTURE,
        x - np.float32(shift[0]) * w,
        y - np.float32(shift[1]) * w,
        cv2.INTER_CUBIC,
        borderMode=cv2.BORDER_REFLECT,
    )
    image = (background() + moved[..., None]) * gain
    if seed is not None:
        image = image + np.random.default_rng(seed).standard_normal(image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


def tracker(**options):
    return DenseFlowTracker(DenseFlowOptions(**options), BuildContext(VirtualClock(), 0))


def rms(tracks, reference, shift):
    error = tracks.xy_px[tracks.valid] - reference.xy_px[tracks.valid] - shift
    return float(np.sqrt((error**2).mean()))


@pytest.mark.parametrize(
    "shift", [(0.0, 0.0), (0.25, -0.4), (0.7, 0.3), (3.0, -2.0), (10.0, 0.0), (0.0, -10.0), (7.0, 7.0)]
)
def test_motions_are_followed(shift):
    flow = tracker()
    reference = flow.start(frame(textured(seed=1), 0))
    tracks = flow.update(frame(textured(shift, seed=2), 1))
    error = rms(tracks, reference, shift)
    print(f"dis {shift}: rms {error:.3f} px, {tracks.valid.sum()} of {reference.count}")
    assert tracks.valid.sum() >= 0.8 * reference.count
    assert error <= 0.3


def test_errors_do_not_add_up_over_a_way_there_and_back():
    flow = tracker()
    reference = flow.start(frame(textured(seed=1), 0))
    for i in range(24):
        shift = (9 * np.sin(i * np.pi / 12), 4 * np.sin(i * np.pi / 6))
        tracks = flow.update(frame(textured(shift, seed=10 + i), i + 1))
        assert rms(tracks, reference, shift) <= 0.3
    assert tracks.valid.all()


def test_brightness_is_no_motion():
    flow = tracker()
    reference = flow.start(frame(textured(seed=1), 0))
    tracks = flow.update(frame(textured((2.0, 1.0), seed=2, gain=1.1), 1))
    assert rms(tracks, reference, (2.0, 1.0)) <= 0.3
    assert tracks.valid.sum() >= 0.8 * reference.count


def test_a_flat_reference_is_refused():
    flat = np.full((HEIGHT, WIDTH, 3), 120, np.uint8)
    with pytest.raises(DataError, match=r"reference frame 4: 0 of 63 sample points have any texture"):
        tracker().start(frame(flat, 4))


@pytest.mark.parametrize("size", [(240, 320), (241, 321), (24, 24), (25, 31)])
@pytest.mark.parametrize("margin_px", [0, 1, 3])
def test_points_on_the_border_of_any_size_are_points_of_the_image(size, margin_px):
    image = textured(seed=1)[: size[0], : size[1]]
    image = np.pad(image, ((0, size[0] - image.shape[0]), (0, size[1] - image.shape[1]), (0, 0)), mode="edge")
    flow = tracker(margin_px=margin_px, least_contrast=0.1)
    reference = flow.start(frame(image, 0))
    assert flow.update(frame(image, 1)).xy_px.shape == (reference.count, 2)


@pytest.mark.parametrize(("size", "margin_px"), [((16, 16), 20), ((23, 300), 0), ((4, 4), 0), ((41, 300), 20)])
def test_an_image_too_small_for_flow_or_grid_is_refused(size, margin_px):
    image = textured(seed=1)[: size[0], : size[1]]
    with pytest.raises(DataError, match=rf"reference frame 4: {size[1]} x {size[0]} pixels"):
        tracker(margin_px=margin_px).start(frame(image, 4))


def test_places_without_texture_are_flagged():
    image = textured(seed=1)
    image[:, : WIDTH // 2] = 120
    flow = tracker()
    reference = flow.start(frame(image, 0))
    bare = reference.xy_px[:, 0] < WIDTH / 2 - 20
    tracks = flow.update(frame(image, 1))
    assert (tracks.flags[bare] == TrackFlag.LOST.value).all()
    assert tracks.valid[reference.xy_px[:, 0] > WIDTH / 2 + 20].all()


@pytest.mark.parametrize("level", [0, 255])
def test_frames_that_show_nothing_are_flagged_and_recovered_from(level):
    flow = tracker()
    reference = flow.start(frame(textured(seed=1), 0))
    blank = np.full((HEIGHT, WIDTH, 3), level, np.uint8)
    for i in range(3):
        assert not flow.update(frame(blank, 1 + i)).valid.any()
    for i in range(3):
        tracks = flow.update(frame(textured((1.0, 2.0), seed=5 + i), 4 + i))
    assert tracks.valid.all()
    assert rms(tracks, reference, (1.0, 2.0)) <= 0.3


def test_reset_forgets_the_flow():
    used, fresh = tracker(), tracker()
    for flow in (used, fresh):
        flow.start(frame(textured(seed=1), 0))
    for i in range(4):
        used.update(frame(textured((4.0 * i, 0.0), seed=i), i + 1))
    used.reset()
    image = textured((1.5, -1.0), seed=9)
    assert np.array_equal(used.update(frame(image, 9)).xy_px, fresh.update(frame(image, 9)).xy_px, equal_nan=True)


def test_nothing_is_followed_before_there_is_a_reference():
    with pytest.raises(RuntimeError, match="start"):
        tracker().update(frame(textured(), 0))
