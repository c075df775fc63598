"""A camera that trembles all over is refused; one on which something moves is not."""

from __future__ import annotations

import numpy as np
import pytest

from lsds.tactile.tile_watch import UNREST_FRAMES, Unrest


def image(rng, noise):
    return np.clip(110 + noise * rng.standard_normal((240, 320, 3)), 0, 255).astype(np.uint8)


@pytest.mark.parametrize(("noise", "refused"), [(1, False), (4, False), (12, True), (40, True)])
def test_noise_is_refused_after_a_few_frames(noise, refused):
    rng, unrest = np.random.default_rng(1), Unrest()
    seen = [unrest.seen(image(rng, noise)) for _ in range(10)]
    assert seen[-1] == refused
    assert not any(seen[:UNREST_FRAMES])


def test_a_light_that_flickers_is_refused_and_one_that_leaps_once_is_not():
    rng, unrest, leaps = np.random.default_rng(1), Unrest(), Unrest()
    seen = [unrest.seen((image(rng, 1) * (1 + 0.3 * (k % 2))).astype(np.uint8)) for k in range(8)]
    assert seen[-1]
    assert not any(leaps.seen((image(rng, 1) * (1 + 0.3 * (k > 3))).astype(np.uint8)) for k in range(8))


def test_what_moves_on_a_part_of_the_gel_is_not_refused():
    rng, unrest = np.random.default_rng(1), Unrest()
    for _ in range(10):
        moving = image(rng, 1)
        moving[:, 60:280] = rng.integers(0, 255, (240, 220, 3))
        assert not unrest.seen(moving)


@pytest.mark.parametrize("size", [(0, 0, 3), (240, 0, 3), (1, 1, 3), (240, 5, 3), (240, 323, 3)])
def test_images_of_any_size_are_looked_at(size):
    rng, unrest = np.random.default_rng(1), Unrest()
    seen = [unrest.seen(rng.integers(0, 255, size).astype(np.uint8)) for _ in range(10)]
    assert any(seen) == (size[1] >= 8)


def test_another_size_starts_again():
    rng, unrest = np.random.default_rng(1), Unrest()
    for k in range(12):
        noisy = image(rng, 40)
        assert not unrest.seen(noisy if k % 2 else noisy[:120, :160])
