"""The fine relief of an object's surface, as a gel shows it: too shallow to matter to the mechanics, but it is seen.

A map of heights, periodic, from noise of a given size; the gel takes its shape where it is pressed on the object. What
the lamps show are its slopes, and they travel and turn with the object.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Pose = tuple[float, float, float]
    Plane = NDArray[np.float32]

SAMPLES, PITCH_M = 512, 0.06e-3
"""Samples of the map along either side, a power of two, and their distance: 31 mm in all."""
STRETCH = 2.0
"""Features are this much longer along the object (y) than across: most surfaces were drawn, rolled or sawn."""
EDGE, SOFT = 0.5, 0.15
"""The gel lies on the object where it is deeper than this share of the deepest point, give or take: so deep is the edge
of a ball's contact (Hertz 1882); about a flat face the surface rises at once."""
FULL_M = 0.15e-3
"""Indentation at which the gel has taken all of the relief's shape."""


class Grain:
    """Slopes of one surface's relief. `height_um` is the RMS height, `size_mm` the size of its features."""

    def __init__(self, height_um: float, size_mm: float, rng: np.random.Generator) -> None:
        shape = (SAMPLES, SAMPLES)
        waves = np.fft.rfft2(rng.standard_normal(shape))
        ky, kx = np.fft.fftfreq(SAMPLES, PITCH_M)[:, None], np.fft.rfftfreq(SAMPLES, PITCH_M)[None, :]
        # Features of a size are half a wave: a band about that wave number, an octave wide.
        k = np.hypot(kx, ky * STRETCH) * 2 * size_mm * 1e-3
        waves *= np.exp(-0.5 * (np.log2(np.maximum(k, 1e-9)) / 0.5) ** 2) / np.maximum(k, 0.1)
        waves[0, 0] = 0
        height = np.fft.irfft2(waves, s=shape)
        scale = height_um * 1e-6 / height.std()
        slope_x = np.fft.irfft2(2j * np.pi * kx * waves, s=shape) * scale
        slope_y = np.fft.irfft2(2j * np.pi * ky * waves, s=shape) * scale
        self._slopes = np.ascontiguousarray(np.stack([slope_x, slope_y], axis=-1), np.float32)

    def paint(
        self,
        out: Plane,
        pose: Pose,
        depth_m: Plane,
        x_m: NDArray[np.float64],
        y_m: NDArray[np.float64],
        per_slope: tuple[Plane, Plane],
        mirror: float = 1.0,
    ) -> bool:
        """Write the change of levels (H, W, 3) that the relief makes on a grid of `y_m` (H,) by `x_m` (W,); return
        whether anything presses.

        `pose` is where the object is on the pad (m, m, rad), `depth_m` (h, w) the surface at any resolution,
        `per_slope` the levels (H, W, 3) of a slope along x and y. A `mirror` of -1 is the view of the other finger.
        """
        deepest = float(depth_m.max())
        if deepest <= 0:
            return False
        share = (depth_m - np.float32(EDGE * deepest)) * np.float32(1 / (SOFT * deepest)) + np.float32(0.5)
        np.clip(share, 0, min(deepest / FULL_M, 1.0), out=share)
        share = np.asarray(cv2.resize(share, (len(x_m), len(y_m)), interpolation=cv2.INTER_LINEAR), np.float32)
        _paint(out, self._slopes, *pose, share, mirror * x_m, y_m, *per_slope, mirror)
        return True


def prepare() -> None:
    """Load what is compiled: not in the time of the first image that shows a contact."""
    pixel, share, place = np.zeros((1, 1, 3), np.float32), np.ones((1, 1), np.float32), np.zeros(1)
    flat = np.zeros((SAMPLES, SAMPLES, 2), np.float32)
    _paint(pixel, flat, 0.0, 0.0, 0.0, share, place, place, pixel, pixel, 1.0)


_AHEAD = float(SAMPLES * 1024)


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def _paint(
    out: Plane,
    slopes: Plane,
    x: float,
    y: float,
    angle: float,
    share: Plane,
    x_m: NDArray[np.float64],
    y_m: NDArray[np.float64],
    per_x: Plane,
    per_y: Plane,
    mirror: float,
) -> None:
    cos, sin, last = math.cos(angle) / PITCH_M, math.sin(angle) / PITCH_M, SAMPLES - 1
    turn_x, turn_y = np.float32(math.cos(angle)), np.float32(math.sin(angle))
    one, flip = np.float32(1.0), np.float32(mirror)
    for r in range(share.shape[0]):
        along = y_m[r] - y
        for c in range(share.shape[1]):
            shown = share[r, c]
            if shown <= 0:
                out[r, c, 0] = out[r, c, 1] = out[r, c, 2] = 0.0
                continue
            across = x_m[c] - x
            # Whole maps are added so that places are positive, and truncation rounds down.
            at_x, at_y = cos * across + sin * along + _AHEAD, cos * along - sin * across + _AHEAD
            column, row = int(at_x), int(at_y)
            fx, fy = np.float32(at_x - column), np.float32(at_y - row)
            c0, r0 = column & last, row & last
            c1, r1 = (c0 + 1) & last, (r0 + 1) & last
            own_x = (one - fy) * ((one - fx) * slopes[r0, c0, 0] + fx * slopes[r0, c1, 0])
            own_x += fy * ((one - fx) * slopes[r1, c0, 0] + fx * slopes[r1, c1, 0])
            own_y = (one - fy) * ((one - fx) * slopes[r0, c0, 1] + fx * slopes[r0, c1, 1])
            own_y += fy * ((one - fx) * slopes[r1, c0, 1] + fx * slopes[r1, c1, 1])
            slope_x = flip * shown * (turn_x * own_x - turn_y * own_y)
            slope_y = shown * (turn_y * own_x + turn_x * own_y)
            for k in range(3):
                out[r, c, k] = slope_x * per_x[r, c, k] + slope_y * per_y[r, c, k]
