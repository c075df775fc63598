"""Watches the images of one camera in tiles: one that trembles as a whole, one of which a part is frozen.

Noise or flickering light makes an image tremble as a whole; an object that moves on the gel leaves some part of it at
rest. A camera's noise never repeats, so markers in a part that repeats while the rest changes would seem to be at rest.
Uniform areas (saturated, black) may repeat, and so may areas that a codec compresses: what has repeated for some frames
while nothing depended on the image does not count.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

TILES_PER_ROW = 8
"""Number of tiles per row; chosen."""
UNREST = 8.0
"""Mean change of the calmest tile between frames above which an image is unusable, grey levels. Noise of 8 levels
causes it; on 240 real recordings the change reaches at most 4.6 in four consecutive frames."""
UNREST_FRAMES = 4
"""Consecutive frames above the limit: a camera's start, or a press, may change the light abruptly."""
UNREST_ROWS_PX = 48
"""Distance of the rows in which unrest is sought, px."""
LEAST_REPEATS = 3
"""Minimum successive repetitions of a frozen tile; chosen: compression may repeat a calm tile once or twice."""
FROZEN_ROWS_PX = 16
"""Distance of the rows in which a frozen part is sought, px; chosen: a tenth of 240 rows holds one or two of them."""


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
        tiles = tiles_of(image, UNREST_ROWS_PX)
        if tiles is None:
            return False
        before, self._tiles = self._tiles, tiles
        if before is None or before.shape != tiles.shape:
            self._count = 0
            return False
        self.level = float(np.asarray(cv2.absdiff(tiles, before)).mean(axis=1).min())
        self._count = self._count + 1 if self.level > UNREST else 0
        return self._count >= UNREST_FRAMES


class FrozenPart:
    """Watches the images of one camera, in tiles of one row's height."""

    def __init__(self) -> None:
        self._tiles: NDArray[np.uint8] | None = None
        self._repeated = np.zeros(0, np.int64)
        self._may_repeat = np.zeros(0, np.bool_)

    def share(self, image: NDArray[np.uint8], *, learns: bool) -> float:
        """Take an image (height, width, 3) of uint8; return the share of its tiles that are frozen.

        `learns`: nothing depends on the image, so tiles that repeat now may go on doing so. Other arrays than images
        and images of another size than the last one have no frozen tiles; what was learnt of a size is kept.
        """
        before, self._tiles = self._tiles, tiles_of(image, FROZEN_ROWS_PX, FROZEN_ROWS_PX // 2)
        if self._tiles is None or before is None or before.shape != self._tiles.shape:
            self._repeated[:] = 0
            return 0.0
        count = len(self._tiles)
        if len(self._repeated) != count:
            self._repeated, self._may_repeat = np.zeros(count, np.int64), np.zeros(count, np.bool_)
        same = (self._tiles == before).all(axis=1)
        self._repeated = np.where(same, self._repeated + 1, 0)
        frozen = self._repeated >= LEAST_REPEATS
        if learns:
            self._may_repeat |= frozen
        frozen &= ~self._may_repeat
        if not frozen.any():
            return 0.0
        pixels = self._tiles[frozen].reshape(int(frozen.sum()), -1, 3)
        frozen[frozen] = np.ptp(pixels, axis=1).any(axis=1)
        return float(frozen.mean())


def tiles_of(image: NDArray[np.uint8], row_step_px: int, first_row: int = 0) -> NDArray[np.uint8] | None:
    """Return the tiles (n, values) of every `row_step_px`-th row of an image (height, width, 3) of uint8, as a copy.

    Columns that do not fill a tile are left out. None for any other array, and for an image that holds no tile.
    """
    if not (isinstance(image, np.ndarray) and image.dtype == np.uint8 and image.ndim == 3 and image.shape[2] == 3):
        return None
    rows = image[first_row::row_step_px, : image.shape[1] // TILES_PER_ROW * TILES_PER_ROW]
    return rows.reshape(len(rows) * TILES_PER_ROW, -1).copy() if rows.size else None
