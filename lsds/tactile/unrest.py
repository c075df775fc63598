"""Detects an image that trembles as a whole, from noise or flickering light.

An object that moves on the gel leaves some part of the image at rest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.tactile.tiles import tiles_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

UNREST = 8.0
"""Mean change of the calmest tile between frames above which an image is unusable, grey levels. Noise of 8 levels
causes it; on 240 real recordings the change reaches at most 4.6 in four consecutive frames."""
UNREST_FRAMES = 4
"""Consecutive frames above the limit: a camera's start, or a press, may change the light abruptly."""
ROW_DISTANCE_PX = 48
"""Distance of the rows that are compared, px."""


class Unrest:
    """Watches one camera; `level` is the last frame's change in its calmest tile."""

    def __init__(self) -> None:
        self.level = 0.0
        self._tiles: NDArray[np.uint8] | None = None
        self._count = 0

    def seen(self, image: NDArray[np.uint8]) -> bool:
        """Take an image (height, width, 3) of uint8; return whether the last ones tremble as a whole.

        Other arrays are ignored: `check_image` reports their error.
        """
        tiles = tiles_of(image, ROW_DISTANCE_PX)
        if tiles is None:
            return False
        before, self._tiles = self._tiles, tiles
        if before is None or before.shape != tiles.shape:
            self._count = 0
            return False
        self.level = float(np.asarray(cv2.absdiff(tiles, before)).mean(axis=1).min())
        self._count = self._count + 1 if self.level > UNREST else 0
        return self._count >= UNREST_FRAMES
