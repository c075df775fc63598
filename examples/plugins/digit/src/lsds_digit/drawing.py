"""Draw the image of a gel without markers: its grain moves with the surface, and its slopes shade the light.

The grain is what a tracker of dense flow follows. A real gel has it from its paint; strength and size are assumed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from lsds.contracts import SensorSpec
    from lsds.contracts.plant import Touch
    from numpy.typing import NDArray

GREY = 110.0
"""Mean grey level of the untouched gel."""
GRAIN_LEVELS, GRAIN_PX = 14.0, 2.5
"""Standard deviation of the grain (grey levels) and its size (px), assumed."""
LAMP_LEVELS = 30.0
"""Grey levels by which a lamp brightens the border at its side."""
LEVELS_PER_SLOPE = 80.0
"""Grey levels by which a lamp brightens a slope of 1 that faces it."""
LAMPS = np.deg2rad([90.0, 210.0, 330.0])
"""Directions of the red, green and blue lamp: x right, y down."""
NOISE_LEVELS = 2.0
"""Standard deviation of the camera's noise (grey levels)."""
COARSE_PX = 8
"""Distance of the points at which depth and displacement are computed."""


class GelDrawing:
    """Draws images of one gel. The same seed gives the same grain and the same noise."""

    def __init__(self, spec: SensorSpec, seed: list[int]) -> None:
        self._seed = seed
        self._size = (spec.width_px, spec.height_px)
        self._scale = spec.metres_per_px
        width, height = self._size
        x, y = np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)
        self._grid_x, self._grid_y = np.meshgrid(x, y)
        self._x_m = self._metres(width // COARSE_PX, COARSE_PX)
        self._y_m = self._metres(height // COARSE_PX, COARSE_PX)
        across, down = np.meshgrid(self._x_m, self._y_m)
        self._points_m = np.stack([across, down], axis=-1).reshape(-1, 2)
        self._towards = np.stack([np.cos(LAMPS), np.sin(LAMPS)]).astype(np.float32)
        place = np.dstack([2 * self._grid_x / width - 1, 2 * self._grid_y / height - 1])
        self._light = GREY + LAMP_LEVELS * place @ self._towards
        noise = np.random.default_rng([*seed, 0]).normal(size=(height, width)).astype(np.float32)
        grain = cv2.GaussianBlur(noise, (0, 0), GRAIN_PX)
        self._grain = np.asarray(GRAIN_LEVELS * grain / np.std(grain), np.float32)

    def image(self, touch: Touch, seq: int) -> NDArray[np.uint8]:
        """Return a new image, uint8 RGB."""
        shape = (len(self._y_m), len(self._x_m), 2)
        moved_px = touch.displacement_m(self._points_m).reshape(shape) / self._scale
        moved = cv2.resize(moved_px.astype(np.float32), self._size)
        grain = cv2.remap(
            self._grain,
            self._grid_x - moved[..., 0],
            self._grid_y - moved[..., 1],
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REFLECT,
        )
        down, across = np.gradient(touch.depth_m(self._x_m, self._y_m), COARSE_PX * self._scale)
        slopes = cv2.resize(np.dstack([across, down]).astype(np.float32), self._size)
        level = self._light + LEVELS_PER_SLOPE * slopes @ self._towards + grain[..., None]
        level += np.random.default_rng([*self._seed, 1, seq]).normal(0.0, NOISE_LEVELS, level.shape)
        return np.clip(np.rint(level), 0, 255).astype(np.uint8)

    def _metres(self, count: int, step_px: int) -> NDArray[np.float64]:
        return np.asarray(step_px * self._scale * (np.arange(count) - (count - 1) / 2), np.float64)
