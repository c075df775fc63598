"""Finding printed dots: darker than their surroundings, of one size, round."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.tactile.views import HALF

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Minimum area of a dot, px of the half-size mask; chosen.
_MIN_AREA = 6


@dataclass(frozen=True, slots=True, eq=False)
class Dots:
    """Dots found in one image.

    `xy_px` (M, 2) centres in full-resolution pixels, accurate to about 0.3 px; `diameter_px` the typical one; `whole`
    (M,) bool, false if the image border cuts the dot.
    """

    xy_px: NDArray[np.float64]
    whole: NDArray[np.bool_]
    diameter_px: float


def find_dots(mask: NDArray[np.uint8]) -> Dots:
    """Return the dots of a half-size dark mask (h, w): blobs near the median size, not long and thin."""
    height, width = mask.shape
    _, _, stats, centroids = cv2.connectedComponentsWithStats(mask, connectivity=4)
    left, top, wide, high, area = stats[1:].T
    plausible = area >= _MIN_AREA
    if not plausible.any():
        return Dots(np.empty((0, 2)), np.empty(0, bool), 0.0)
    typical = float(np.median(area[plausible]))
    cut = (left == 0) | (top == 0) | (left + wide == width) | (top + high == height)
    keep = (area > np.where(cut, 0.15, 0.35) * typical) & (area < 2.5 * typical)
    keep &= cut | (np.maximum(wide, high) < 2.2 * np.minimum(wide, high))
    # A pixel of the half-size image covers pixels 2i and 2i + 1, whose middle is 2i + 0.5.
    xy = np.asarray(centroids[1:][keep] * HALF + (HALF - 1) / 2, np.float64)
    return Dots(xy, ~cut[keep], 2.0 * HALF * float(np.sqrt(typical / np.pi)))
