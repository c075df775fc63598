"""Camera noise from one large seeded field: each frame takes its own window of it.

Drawing fresh normals for every frame would cost more than all the rest of the image.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds_mocks.optics.pad import HEIGHT_PX, WIDTH_PX

if TYPE_CHECKING:
    from numpy.typing import NDArray

SIGMA_RGB = (2.0, 1.1, 2.0)
NEIGHBOUR_TAP = 0.0822
"""Weight of each neighbour in the filter [t, 1, t]; gives a correlation of 0.16 between neighbouring pixels."""
_MARGIN = 192
_WINDOWS = 1021


class CameraNoise:
    """Adds noise of standard deviation 2.0/1.1/2.0 (R/G/B) and neighbour correlation 0.16, times `level`."""

    def __init__(self, level: float, rng: np.random.Generator) -> None:
        shape = (HEIGHT_PX + _MARGIN, WIDTH_PX + _MARGIN, 3)
        taps = np.array([NEIGHBOUR_TAP, 1.0, NEIGHBOUR_TAP]) / np.sqrt(1 + 2 * NEIGHBOUR_TAP**2)
        white = rng.standard_normal(shape).astype(np.float32)
        field = cv2.sepFilter2D(white, cv2.CV_32F, taps, taps, borderType=cv2.BORDER_REFLECT)
        # Rounding the field to whole levels adds a twelfth of variance, which is taken off beforehand.
        sigma = np.sqrt(np.maximum((level * np.array(SIGMA_RGB)) ** 2 - 1 / 12, 0.0)).astype(np.float32)
        whole = np.rint(field * sigma)
        self._plus = np.clip(whole, 0, 255).astype(np.uint8)
        self._minus = np.clip(-whole, 0, 255).astype(np.uint8)
        self._corners = rng.integers(0, _MARGIN + 1, (_WINDOWS, 2)).tolist()
        self._silent = level == 0

    def apply(self, image: NDArray[np.uint8], seq: int) -> None:
        """Add frame `seq`'s noise in place, saturating at 0 and 255."""
        if self._silent:
            return
        y, x = self._corners[seq % _WINDOWS]
        window = (slice(y, y + HEIGHT_PX), slice(x, x + WIDTH_PX))
        cv2.add(image, self._plus[window], dst=image)
        cv2.subtract(image, self._minus[window], dst=image)
