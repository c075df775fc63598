"""Printed dots as a transmission map, placed to a 256th of a pixel by a bank of ready-made stamps."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.optics.pad import HEIGHT_PX, WIDTH_PX

if TYPE_CHECKING:
    from numpy.typing import NDArray

PHASES = 128
"""Sub-pixel positions per axis: a stamp's centre is at most 1/256 px from where it should be."""
_TABLE = 8192


@lru_cache(maxsize=8)
def stamp_bank(diameter_px: float, core: float, blur_px: float) -> NDArray[np.uint8]:
    """Return (phases y, phases x, size, size) transmissions, 255 for clear: disks with an edge of Gaussian blur."""
    radius = diameter_px / 2
    # Beyond, the blurred edge darkens by less than half a level of 255.
    reach = radius + 2.9 * blur_px
    half = math.ceil(reach + 0.5)
    table_r = np.sqrt(np.linspace(0, (half + 1) ** 2 * 2, _TABLE))
    cover = np.array([0.5 * math.erfc((r - radius) / (math.sqrt(2) * blur_px)) for r in table_r])
    table = np.rint(255 * (1 - (1 - core) * cover)).astype(np.uint8)
    offset = np.arange(-half, half + 1)[None, :] - (np.arange(PHASES)[:, None] / PHASES - 0.5)
    square = (offset * offset * ((_TABLE - 1) / ((half + 1) ** 2 * 2))).astype(np.float32)
    size = 2 * half + 1
    bank = np.empty((PHASES, PHASES, size, size), np.uint8)
    for phase in range(PHASES):
        index = square[phase][None, :, None] + square[:, None, :]
        bank[phase] = table[np.minimum(index + 0.5, _TABLE - 1).astype(np.intp)]
    return bank


class DotPainter:
    """Draws dots into a transmission map (240, 320) uint8; where dots overlap the darker one counts."""

    def __init__(self, diameter_px: float, core: float, blur_px: float) -> None:
        self._bank = stamp_bank(diameter_px, core, blur_px)
        self._size = size = int(self._bank.shape[-1])
        self._padded = np.empty((HEIGHT_PX + 2 * size, WIDTH_PX + 2 * size), np.uint8)
        self._view = self._padded[size : size + HEIGHT_PX, size : size + WIDTH_PX]

    def paint(self, xy_px: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return the map for dot centres (N, 2); valid until the next call. Dots out of the image are left out."""
        padded, bank, size = self._padded, self._bank, self._size
        padded.fill(255)
        fine = np.rint((xy_px + 0.5) * PHASES).astype(np.int64)
        corner = fine // PHASES + (size - size // 2)
        phase = fine % PHASES
        visible = (corner >= 0).all(axis=1) & (corner[:, 0] <= WIDTH_PX + size) & (corner[:, 1] <= HEIGHT_PX + size)
        crowded = self._crowded(corner)
        for seen, (x, y), (i, j) in zip(visible.tolist(), corner.tolist(), phase.tolist(), strict=True):
            if not seen:
                continue
            stamp, spot = bank[j, i], (slice(y, y + size), slice(x, x + size))
            padded[spot] = np.minimum(padded[spot], stamp) if crowded else stamp
        return self._view

    def _crowded(self, corner: NDArray[np.int64]) -> bool:
        """Tell whether any two stamps overlap; where none do, which is the rule, they need not be compared."""
        x, y = corner[:, 0].astype(np.int16), corner[:, 1].astype(np.int16)
        apart = np.maximum(np.abs(np.subtract.outer(x, x)), np.abs(np.subtract.outer(y, y)))
        return int(np.count_nonzero(apart < self._size)) > len(corner)
