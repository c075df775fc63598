"""Notices a camera whose whole image trembles: noise, or a light that flickers. Where an object moves on the gel, some
part of the image is still at rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

UNREST = 8.0
"""Mean change from frame to frame (levels) of the calmest tile that is no measurement any more. On 240 real recordings
it is at most 4.6 for four frames in a row; noise of 8 levels gives it."""
PATIENCE = 4
"""Frames in a row: a camera may open, or be pressed on, with a leap of its light."""
ROWS, TILES = 48, 8
"""Every so many rows are looked at, in so many tiles each."""


class Unrest:
    """Watches one camera; `level` is the last frame's change in its calmest tile."""

    def __init__(self) -> None:
        self.level = 0.0
        self._rows: NDArray[np.uint8] | None = None
        self._count = 0

    def seen(self, image: NDArray[np.uint8]) -> bool:
        """Take an image (height, width, 3) of uint8; return whether the last ones tremble all over.

        What is no such image is not taken: `check_image` says what is wrong with it.
        """
        if not (isinstance(image, np.ndarray) and image.dtype == np.uint8 and image.ndim == 3 and image.size):
            return False
        # Columns that do not fill a tile are left out.
        rows = np.ascontiguousarray(image[::ROWS, : max(TILES, image.shape[1] // TILES * TILES)])
        before, self._rows = self._rows, rows
        if before is None or before.shape != rows.shape or rows.shape[1] % TILES:
            self._count = 0
            return False
        change = np.asarray(cv2.absdiff(rows, before))
        self.level = float(change.reshape(len(rows) * TILES, -1).mean(axis=1).min())
        self._count = self._count + 1 if self.level > UNREST else 0
        return self._count >= PATIENCE
