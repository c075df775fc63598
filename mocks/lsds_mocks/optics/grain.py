"""Fine relief of an object's surface in the gel's image: visible, but too shallow to affect the mechanics.

The relief is a periodic height map of noise with a given feature size. The gel takes its shape where it is pressed on
the object. The lamps show its slopes, which move and rotate with the object.
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

GRAIN_SAMPLES = 512
"""Samples of the map along each side, a power of two: 31 mm."""
GRAIN_PITCH_M = 0.06e-3
"""Distance between samples of the map."""
GRAIN_STRETCH = 2.0
"""Length of features along the object (y) over their width: most surfaces are drawn, rolled or sawn."""
CONTACT_EDGE_SHARE = 0.5
"""Depth, as part of the greatest depth, above which the gel touches the object: the depth at the edge of a ball's
contact (Hertz 1882); around a flat face the surface rises at once."""
SOFT = 0.15
"""Width of the transition around `CONTACT_EDGE_SHARE`, as part of the greatest depth."""
FULL_M = 0.15e-3
"""Indentation at which the gel follows the relief completely."""


class Grain:
    """Slopes of one surface's relief. `height_um` is the RMS height, `size_mm` the size of its features."""

    def __init__(self, height_um: float, size_mm: float, rng: np.random.Generator) -> None:
        shape = (GRAIN_SAMPLES, GRAIN_SAMPLES)
        waves = np.fft.rfft2(rng.standard_normal(shape))
        ky, kx = (
            np.fft.fftfreq(GRAIN_SAMPLES, GRAIN_PITCH_M)[:, None],
            np.fft.rfftfreq(GRAIN_SAMPLES, GRAIN_PITCH_M)[None, :],
        )
        # A feature is half a wave, so the noise fills a band one octave wide around that wave number.
        k = np.hypot(kx, ky * GRAIN_STRETCH) * 2 * size_mm * 1e-3
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
        """Write the change of levels (H, W, 3) due to the relief on a grid of `y_m` (H,) by `x_m` (W,).

        Return whether there is contact. `pose` is the object's pose on the pad (m, m, rad), `depth_m` (h, w) the
        surface at any resolution,
        `per_slope` the levels (H, W, 3) of a slope along x and y. A `mirror` of -1 is the view of the other finger.
        """
        deepest = float(depth_m.max())
        if deepest <= 0:
            return False
        share = (depth_m - np.float32(CONTACT_EDGE_SHARE * deepest)) * np.float32(1 / (SOFT * deepest)) + np.float32(
            0.5
        )
        np.clip(share, 0, min(deepest / FULL_M, 1.0), out=share)
        share = np.asarray(cv2.resize(share, (len(x_m), len(y_m)), interpolation=cv2.INTER_LINEAR), np.float32)
        _paint(out, self._slopes, *pose, share, mirror * x_m, y_m, *per_slope, mirror)
        return True


def prepare() -> None:
    """Load the compiled code, so that the first image with a contact does not wait for it."""
    pixel, share, place = np.zeros((1, 1, 3), np.float32), np.ones((1, 1), np.float32), np.zeros(1)
    flat = np.zeros((GRAIN_SAMPLES, GRAIN_SAMPLES, 2), np.float32)
    _paint(pixel, flat, 0.0, 0.0, 0.0, share, place, place, pixel, pixel, 1.0)


_AHEAD = float(GRAIN_SAMPLES * 1024)


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
    cos, sin, last = math.cos(angle) / GRAIN_PITCH_M, math.sin(angle) / GRAIN_PITCH_M, GRAIN_SAMPLES - 1
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
            # Adding whole map lengths makes positions positive, so that truncation rounds down.
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
