"""Detects a part of the image that repeats while the rest changes: markers there would seem to be at rest.

A camera's noise never repeats. Uniform areas (saturated, black) may, and so may areas that a codec compresses: what has
repeated for some frames while nothing depended on the image does not count.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds.tactile.tiles import tiles_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

LEAST_REPEATS = 3
"""Minimum successive repetitions of a frozen tile; chosen: compression may repeat a calm tile once or twice."""
ROW_STEP_PX = 16
"""Distance of the rows that are compared, px; chosen: a band of a tenth of 240 rows holds one or two of them."""


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
        before, self._tiles = self._tiles, tiles_of(image, ROW_STEP_PX, ROW_STEP_PX // 2)
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
