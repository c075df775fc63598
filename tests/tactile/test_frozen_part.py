"""A part of the image that repeats while the rest changes is frozen; calm, compressed and saturated places are not."""

from __future__ import annotations

import numpy as np
import pytest

from lsds.contracts import Frame, SensorSpec
from lsds.errors import SafetyStop
from lsds.safety.guard import SafetyOptions
from lsds.tactile.gate import FrameGate
from lsds.tactile.tile_watch import LEAST_REPEATS, FrozenPart

MS = 1_000_000
HALF = np.s_[:, :160]


def image(rng):
    return np.clip(110 + 2 * rng.standard_normal((240, 320, 3)), 0, 255).astype(np.uint8)


def shares(images, learnt=0):
    """Return the frozen share after each image; nothing depends on the first `learnt`."""
    part = FrozenPart()
    return [part.share(shown, learns=at < learnt) for at, shown in enumerate(images)]


def with_half_of(images, half):
    for shown in images:
        shown[HALF] = half
    return images


def test_a_half_that_repeats_is_frozen_after_a_few_frames():
    rng = np.random.default_rng(1)
    found = shares(with_half_of([image(rng) for _ in range(8)], image(rng)[HALF]))
    assert found[:LEAST_REPEATS] == [0] * LEAST_REPEATS
    assert found[LEAST_REPEATS:] == [0.5] * (8 - LEAST_REPEATS)


def test_a_camera_whose_noise_goes_on_is_not():
    rng = np.random.default_rng(1)
    assert not any(shares([image(rng) for _ in range(30)]))


def test_places_that_repeat_while_nothing_depends_on_them_may_go_on():
    rng = np.random.default_rng(1)
    assert not any(shares(with_half_of([image(rng) for _ in range(12)], image(rng)[HALF]), learnt=5))


@pytest.mark.parametrize("level", [0, 255])
def test_black_and_saturated_places_are_not(level):
    rng = np.random.default_rng(1)
    assert not any(shares(with_half_of([image(rng) for _ in range(12)], level)))


def test_a_repeated_image_before_the_grasp_teaches_nothing():
    rng = np.random.default_rng(1)
    first = image(rng)
    found = shares([first, first, *with_half_of([image(rng) for _ in range(12)], image(rng)[HALF])], learnt=4)
    assert found[-1] == 0.5


def test_one_damaged_frame_does_not_forget_what_may_repeat():
    rng = np.random.default_rng(1)
    images = with_half_of([image(rng) for _ in range(20)], image(rng)[HALF])
    images[10] = images[10][:120]
    assert not any(shares(images, learnt=6))


@pytest.mark.parametrize("frozen", [np.s_[193:], np.s_[:, 240:], np.s_[60:180, 80:200]])
def test_any_band_or_patch_is_found(frozen):
    rng = np.random.default_rng(1)
    still = image(rng)
    images = [image(rng) for _ in range(8)]
    for shown in images:
        shown[frozen] = still[frozen]
    assert shares(images)[-1] > 0.1


def test_another_size_starts_again():
    rng = np.random.default_rng(1)
    images = [image(rng)[: 240 - 120 * (at % 2)] for at in range(12)]
    assert not any(shares(with_half_of(images, 7)))


@pytest.mark.parametrize("size", [(240, 320, 4), (240, 320, 1), (240, 320), (0, 0, 3), (4, 4, 3), (240, 5, 3)])
def test_arrays_that_are_no_images_are_left_to_other_checks(size):
    rng, part = np.random.default_rng(1), FrozenPart()
    for _ in range(6):
        assert part.share(rng.integers(0, 255, size).astype(np.uint8), learns=False) == 0


def admitted(gate, images, *, depends):
    """Return how many images the gate admits; raise what it raises."""
    taken = 0
    for seq, shown in enumerate(images):
        taken += gate.admit(Frame(shown, seq * 40 * MS, seq), seq * 40 * MS, depends=depends)
    return taken


def test_a_gate_stops_for_it_only_while_something_depends_on_it():
    rng = np.random.default_rng(1)
    images = with_half_of([image(rng) for _ in range(20)], image(rng)[HALF])
    spec = SensorSpec(320, 240, 25.0, 0.0634e-3)
    assert admitted(FrameGate("sensor", spec, SafetyOptions(), 0), images, depends=False) == 20
    with pytest.raises(SafetyStop, match=r"sensor: 50 % of the image has repeated for 0\.24 s, the limit is 0\.20 s"):
        admitted(FrameGate("sensor", spec, SafetyOptions(), 0), images[:12], depends=True)
