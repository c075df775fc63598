"""The fine relief of an object: seen, carried along with the object, turned with it, and without weight."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest
from lsds_mocks.optics.grain import FULL_M, GRAIN_PITCH_M, GRAIN_SAMPLES, Grain

SHAPE = (120, 160)
X = (np.arange(SHAPE[1]) - (SHAPE[1] - 1) / 2) * 0.125e-3
Y = (np.arange(SHAPE[0]) - (SHAPE[0] - 1) / 2) * 0.125e-3
DEEP = np.full((60, 80), FULL_M, np.float32)
ALONG_X = (np.ones((*SHAPE, 3), np.float32), np.zeros((*SHAPE, 3), np.float32))
ALONG_Y = ALONG_X[::-1]


def grain() -> Grain:
    return Grain(5.0, 0.4, np.random.default_rng(1))


def painted(pose=(0.0, 0.0, 0.0), depth=DEEP, per=ALONG_X, mirror=1.0) -> np.ndarray:
    out = np.empty((*SHAPE, 3), np.float32)
    assert grain().paint(out, pose, depth, X, Y, per, mirror)
    return out[..., 0]


def test_the_same_seed_gives_the_same_relief_and_another_another():
    assert np.array_equal(grain()._slopes, grain()._slopes)
    assert not np.array_equal(grain()._slopes, Grain(5.0, 0.4, np.random.default_rng(2))._slopes)


def test_heights_and_features_have_the_given_size():
    slopes = grain()._slopes.astype(float)
    # Heights from the slopes along x, by Fourier's integral; what does not vary along x has none.
    kx = np.fft.rfftfreq(GRAIN_SAMPLES, GRAIN_PITCH_M)[None, :]
    waves = np.fft.rfft2(slopes[..., 0])
    height = np.fft.irfft2(
        np.where(kx > 0, waves / np.where(kx > 0, 2j * np.pi * kx, 1), 0), s=(GRAIN_SAMPLES, GRAIN_SAMPLES)
    )
    assert height.std() == pytest.approx(5e-6, rel=0.05)
    power = (np.abs(waves) ** 2 / np.where(kx > 0, kx, 1) ** 2).sum(axis=0)[1:]
    middle = float((power * kx[0, 1:]).sum() / power.sum())
    assert 0.5 / middle == pytest.approx(0.4e-3, rel=0.6)


def test_it_travels_with_the_object():
    step = X[1] - X[0]
    still, moved = painted(), painted((3 * step, -2 * step, 0.0))
    assert np.allclose(moved[:-2, 3:], still[2:, :-3], atol=1e-5)


def test_it_repeats_after_its_own_size():
    assert np.allclose(
        painted(), painted((GRAIN_SAMPLES * GRAIN_PITCH_M, -GRAIN_SAMPLES * GRAIN_PITCH_M, 0.0)), atol=1e-4
    )


def test_slopes_turn_with_the_object():
    quarter = painted((0.0, 0.0, math.pi / 2), per=ALONG_Y)
    still = painted()
    size = min(SHAPE)
    square = np.s_[(SHAPE[0] - size) // 2 : (SHAPE[0] + size) // 2, (SHAPE[1] - size) // 2 : (SHAPE[1] + size) // 2]
    # Turned by a quarter, what fell along x falls along y, at the place that x has turned to.
    assert np.allclose(quarter[square], np.rot90(still[square], -1), atol=1e-4)


def test_the_other_finger_sees_it_mirrored():
    assert np.allclose(painted(mirror=-1.0), -painted()[:, ::-1], atol=1e-5)


def test_it_is_seen_where_the_gel_lies_on_the_object_and_grows_with_pressing():
    half = DEEP.copy()
    half[:, 40:] = 0.0
    shown = painted(depth=half)
    assert not shown[:, 90:].any()
    assert np.abs(shown[:, :70]).mean() > 0
    assert np.allclose(painted(depth=DEEP / 2), painted() / 2, atol=1e-6)
    assert not grain().paint(np.empty((*SHAPE, 3), np.float32), (0, 0, 0), DEEP * 0, X, Y, ALONG_X)


def test_nothing_is_left_to_compile_at_the_first_contact():
    """On the wire a picture that has to wait for the compiler is half a second late: the cell stops at first touch."""
    script = """
import numpy as np
from lsds_mocks.optics import grain
from lsds_mocks.optics.grain import Grain
from lsds_mocks.devices.look import look_of
from lsds_mocks.devices.gelsight_options import GelSightOptions
from lsds_mocks.optics.renderer import Renderer
renderer = Renderer(look_of(GelSightOptions()), [1])
renderer.prepare()
known = list(grain._paint.signatures)
shader = renderer._shader
deep = np.full((len(shader.y_m), len(shader.x_m)), 1e-4, np.float32)
shader.lit(deep, (Grain(4.0, 0.4, np.random.default_rng(1)), (1e-3, np.float64(0.0), 0.1)))
assert known and grain._paint.signatures == known, (known, grain._paint.signatures)
"""
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120, check=False)
    assert run.returncode == 0, run.stderr
