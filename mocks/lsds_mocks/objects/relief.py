"""Texture on a shape: a periodic map of the surface's depth below its highest points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numba import njit

from lsds_mocks.gel.shapes import Unturned

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.shapes import Shape


@dataclass(frozen=True, eq=False)
class Relief(Unturned):
    """A shape with a surface lowered by a periodic map `depth_m` (rows, columns) of sample distance `pitch_m`.

    Row 0 is at the smallest y; the map is centred on the shape.
    """

    base: Shape
    depth_m: NDArray[np.float32]
    pitch_m: float

    def gap(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gap of the shape plus the map, linear between its samples."""
        x, y = np.broadcast_arrays(x_m, y_m)
        if not x.size:
            return self.base.gap(x_m, y_m)
        rows, columns = self.depth_m.shape
        # OpenCV takes two-dimensional images only, and wraps an image around once.
        at_x, at_y = _wrapped(x.ravel(), self.pitch_m, columns), _wrapped(y.ravel(), self.pitch_m, rows)
        pieces = [
            cv2.remap(
                self.depth_m,
                at_x[:, i : i + _REMAP],
                at_y[:, i : i + _REMAP],
                cv2.INTER_LINEAR,
                borderMode=cv2.BORDER_WRAP,
            )
            for i in range(0, at_x.shape[1], _REMAP)
        ]
        relief = np.concatenate(pieces, axis=1).reshape(x.shape)
        return np.asarray(self.base.gap(x_m, y_m) + relief)

    def least_gap(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gap of the shape's highest points."""
        return self.base.least_gap(x_m, y_m)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _wrapped(at_m: NDArray[np.float64], pitch_m: float, size: int) -> NDArray[np.float32]:
    """Return positions (1, n) along one axis of a periodic map, in samples from 0 to `size`."""
    found = np.empty((1, at_m.size), np.float32)
    for i in range(at_m.size):
        place = at_m[i] / pitch_m + (size - 1) / 2
        found[0, i] = place - size * math.floor(place / size)
    return found


_REMAP = 32_000
"""Maximum number of points that OpenCV remaps at a time."""


def pores(rng: np.random.Generator, *, size_m: float, depth_m: float, open_share: float) -> NDArray[np.float32]:
    """Return the map of a sponge: holes of about `size_m`, with sloped rims, over `open_share` of the surface."""
    field = noise(rng, size_m)
    rim = float(np.quantile(field, 1 - open_share))
    return np.asarray(depth_m * np.clip((field - rim) / 0.5, 0, 1), np.float32)


def bumps(rng: np.random.Generator, *, size_m: float, depth_m: float) -> NDArray[np.float32]:
    """Return the map of a rough surface: hills about `size_m` apart, `depth_m` from top to bottom."""
    field = noise(rng, size_m)
    low, high = np.quantile(field, (0.01, 0.99))
    return np.asarray(depth_m * np.clip((high - field) / (high - low), 0, 1), np.float32)


def weave(*, period_m: float, depth_m: float) -> NDArray[np.float32]:
    """Return the map of a cloth cover: two sets of threads, over and under."""
    samples = max(8, round(TILE_M / MAP_PITCH_M))
    threads = max(1, round(TILE_M / period_m))
    phase = 2 * np.pi * threads * np.arange(samples) / samples
    up = 0.25 * (2 + np.cos(phase)[None, :] * np.cos(phase / 2)[:, None] + np.cos(phase)[:, None])
    return np.asarray(depth_m * (1 - up), np.float32)


TILE_M = 24e-3
"""Side of a generated map."""
MAP_PITCH_M = 0.12e-3
"""Distance between samples of a generated map."""


def noise(rng: np.random.Generator, scale_m: float) -> NDArray[np.float64]:
    """Return a smooth periodic random map of unit variance with features of about `scale_m`."""
    samples = round(TILE_M / MAP_PITCH_M)
    waves = np.fft.rfft2(rng.standard_normal((samples, samples)))
    k = np.hypot(np.fft.fftfreq(samples)[:, None], np.fft.rfftfreq(samples)[None, :]) / MAP_PITCH_M
    waves *= np.exp(-0.5 * (k * scale_m * 1.5) ** 2)
    waves[0, 0] = 0
    field = np.fft.irfft2(waves, s=(samples, samples))
    return np.asarray(field / field.std())
