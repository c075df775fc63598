"""Compiled sums of the sharpness of an image (`lsds.tactile.imprint.motion.sharpness`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds.support.jit import compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray


@compiled
def squares_of(grey: NDArray[np.uint8]) -> tuple[float, float]:
    """Return the sum of the squared differences of neighbouring pixels (h, w), and the sum of the pixels."""
    height, width = grey.shape
    squared = total = 0.0
    for y in range(height):
        row, below = grey[y], grey[min(y + 1, height - 1)]
        across = down = own = np.int32(0)
        for x in range(width - 1):
            step = np.int32(row[x + 1]) - np.int32(row[x])
            across += step * step
        for x in range(width):
            step = np.int32(below[x]) - np.int32(row[x])
            down += step * step
            own += np.int32(row[x])
        squared += float(across + down)
        total += float(own)
    return squared, total
