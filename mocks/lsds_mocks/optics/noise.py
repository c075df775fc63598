"""Camera noise from one large seeded field, of which each frame uses a different window.

Drawing new random numbers for every frame would take longer than the rest of the image.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np
from numba import njit

from lsds_mocks.optics.pad import HEIGHT_PX, WIDTH_PX

if TYPE_CHECKING:
    from numpy.typing import NDArray

SIGMA_RGB = (2.0, 1.1, 2.0)
"""Standard deviation of the noise in R, G and B at a level of 1, grey levels; published values."""
NEIGHBOUR_TAP = 0.0822
"""Weight of each neighbour in the filter [t, 1, t]; gives a correlation of 0.16 between neighbouring pixels."""
_FINE_BITS = 4
"""Fractional bits of light and noise: sums are in sixteenths of a level."""
_GAIN_BITS = 17
"""Fractional bits of a gain, the most with which light times ink times a gain of up to 4 fits into 32 bits."""
_MARGIN_PX = 192
"""Excess of the noise field over the image in both directions, px: the range of the window's position; chosen."""
_WINDOWS = 1021
"""Number of windows that frames use in turn, after which the noise repeats; chosen, a prime."""


class CameraNoise:
    """Adds noise of standard deviation 2.0/1.1/2.0 (R/G/B) and neighbour correlation 0.16, times `level`."""

    def __init__(self, level: float, rng: np.random.Generator) -> None:
        shape = (HEIGHT_PX + _MARGIN_PX, WIDTH_PX + _MARGIN_PX, 3)
        taps = np.array([NEIGHBOUR_TAP, 1.0, NEIGHBOUR_TAP]) / np.sqrt(1 + 2 * NEIGHBOUR_TAP**2)
        white = rng.standard_normal(shape).astype(np.float32)
        field = cv2.sepFilter2D(white, cv2.CV_32F, taps, taps, borderType=cv2.BORDER_REFLECT)
        # Rounding to whole levels adds a variance of 1/12, which is subtracted here.
        sigma = np.sqrt(np.maximum((level * np.array(SIGMA_RGB)) ** 2 - 1 / 12, 0.0)).astype(np.float32)
        self._field = np.rint(field * sigma * 2**_FINE_BITS).astype(np.int16).reshape(shape[0], -1)
        self._corners = rng.integers(0, _MARGIN_PX + 1, (_WINDOWS, 2)).tolist()

    def photograph(self, lit: NDArray[np.uint8], cover: NDArray[np.uint8], gain: float, seq: int) -> NDArray[np.uint8]:
        """Return frame `seq` with noise, in whole levels from 0 to 255.

        It is the lit gel (h, w, 3) times the transmission of the ink (of 255) times a gain. As in a sensor, noise is
        added before rounding; otherwise a lamp that fades by a tenth of a level would move contours of a whole level
        over the image.
        """
        y, x = self._corners[seq % _WINDOWS]
        out = np.empty(lit.shape, np.uint8)
        scale = np.int32(round(gain * 2 ** (_FINE_BITS + _GAIN_BITS) / 255.0))
        gel, ink = lit.reshape(HEIGHT_PX, -1), cover.reshape(HEIGHT_PX, -1)
        _count(gel, ink, self._field, y, 3 * x, scale, out.reshape(HEIGHT_PX, -1))
        return out


@njit(cache=True)  # type: ignore[untyped-decorator]
def _count(
    lit: NDArray[np.uint8],
    cover: NDArray[np.uint8],
    field: NDArray[np.int16],
    row: int,
    column: int,
    scale: np.int32,
    out: NDArray[np.uint8],
) -> None:
    """Multiply, add noise and round, in integers; each row is sliced first so that the loop is vectorized."""
    width = lit.shape[1]
    for i in range(lit.shape[0]):
        light, ink, noise, into = lit[i], cover[i], field[row + i, column : column + width], out[i]
        for j in range(width):
            product = np.int32(light[j]) * np.int32(ink[j]) * scale
            fine = ((product + np.int32(2 ** (_GAIN_BITS - 1))) >> np.int32(_GAIN_BITS)) + np.int32(noise[j])
            whole = (fine + np.int32(2 ** (_FINE_BITS - 1))) >> np.int32(_FINE_BITS)
            into[j] = max(min(whole, np.int32(255)), np.int32(0))
