"""Colour from surface slopes by one matrix for the whole image, at a quarter of the resolution.

Grey levels per unit slope of the depth (y down), measured on one GelSight Mini: R = -14 gx - 88 gy,
G = +84 gx + 9 gy, B = +11 gx + 62 gy (R2 0.71-0.92).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds_mocks.optics.pad import HEIGHT_PX, WIDTH_PX

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

SLOPE_TO_RGB = np.array([[-14.0, -88.0], [84.0, 9.0], [11.0, 62.0]], np.float32)
REDUCTION = 4


class Shader:
    """Background plus slope colour; keeps the last image, as the surface rarely changes from frame to frame."""

    def __init__(self, background: NDArray[np.float32], metres_per_px: float) -> None:
        self._background = background
        self._plain = np.clip(np.rint(background), 0, 255).astype(np.uint8)
        self._spacing = REDUCTION * metres_per_px
        self._x = _axis(WIDTH_PX, metres_per_px)
        self._y = _axis(HEIGHT_PX, metres_per_px)
        self._key: object = None
        self._image = self._plain
        self._float = np.empty_like(background)

    def shade(self, key: object, depth: Callable[..., NDArray[np.float32]], touching: bool) -> NDArray[np.uint8]:
        """Return the lit gel (240, 320, 3); `key` tells whether the surface is still the same."""
        if not touching:
            return self._plain
        if key != self._key:
            self._key = key
            self._image = self._lit(depth(self._x, self._y))
        return self._image

    def _lit(self, depth: NDArray[np.float32]) -> NDArray[np.uint8]:
        scale = 0.5 / self._spacing
        gx = cv2.Sobel(depth, cv2.CV_32F, 1, 0, ksize=1, scale=scale, borderType=cv2.BORDER_REPLICATE)
        gy = cv2.Sobel(depth, cv2.CV_32F, 0, 1, ksize=1, scale=scale, borderType=cv2.BORDER_REPLICATE)
        colour = cv2.transform(cv2.merge([gx, gy]), SLOPE_TO_RGB)
        cv2.resize(colour, (WIDTH_PX, HEIGHT_PX), dst=self._float, interpolation=cv2.INTER_LINEAR)
        lit = cv2.add(self._float, self._background, dtype=cv2.CV_8U)
        return np.asarray(lit, np.uint8)


def _axis(size: int, metres_per_px: float) -> NDArray[np.float64]:
    """Positions (m) of the reduced pixels' centres from the image's centre."""
    pixels = (np.arange(size // REDUCTION) + 0.5) * REDUCTION - 0.5
    return np.asarray((pixels - (size - 1) / 2) * metres_per_px)
