"""Printed markers as a transmission map, placed to a 256th of a pixel by a bank of precomputed stamps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from lsds_mocks.byte_cache import kept
from lsds_mocks.optics.pad import HEIGHT_PX, WIDTH_PX

if TYPE_CHECKING:
    from numpy.typing import NDArray

PHASES = 128
"""Sub-pixel positions per axis: a stamp's centre is at most 1/256 px off."""
_TABLE = 8192
"""Number of entries of the table from squared radius to transmission; chosen."""
_FAR_PX = 1e4
"""Coordinate to which a marker far outside the image is clipped, px; chosen far beyond any image."""


@kept
def stamp_bank(diameter_px: float, core: float, blur_px: float) -> NDArray[np.uint8]:
    """Return (phases y, phases x, size, size) transmissions, 255 for clear: disks with an edge of Gaussian blur."""
    radius = diameter_px / 2
    # Beyond this size, the blurred edge darkens by less than half a level of 255.
    reach = radius + 2.9 * blur_px
    half = math.ceil(reach + 0.5)
    table_r = np.sqrt(np.linspace(0, (half + 1) ** 2 * 2, _TABLE))
    cover = np.array([0.5 * math.erfc((r - radius) / (math.sqrt(2) * blur_px)) for r in table_r])
    table = np.rint(255 * (1 - (1 - core) * cover)).astype(np.uint8)
    offset = np.arange(-half, half + 1)[None, :] - (np.arange(PHASES)[:, None] / PHASES - 0.5)
    square = (offset * offset * ((_TABLE - 1) / ((half + 1) ** 2 * 2))).astype(np.float32)
    size = 2 * half + 1
    bank = np.empty((PHASES, PHASES, size, size), np.uint8)
    _fill(bank, table, square)
    return bank


@njit(cache=True)  # type: ignore[untyped-decorator]
def _fill(bank: NDArray[np.uint8], table: NDArray[np.uint8], square: NDArray[np.float32]) -> None:
    """Fill `bank` from each pixel's squared distance to the centre; `square` (phases, size) is the part of one axis."""
    for phase_y in range(bank.shape[0]):
        for phase_x in range(bank.shape[1]):
            for i, down in enumerate(square[phase_y]):
                for j, across in enumerate(square[phase_x]):
                    index = (down + across) + np.float32(0.5)
                    bank[phase_y, phase_x, i, j] = table[min(int(index), _TABLE - 1)]


class DotPainter:
    """Draws markers into a transmission map (240, 320) uint8; if markers overlap, the darker one counts.

    `strength` (N,) is the remaining fraction of each marker's ink.
    """

    def __init__(
        self, diameter_px: float, core: float, blur_px: float, strength: NDArray[np.float64] | None = None
    ) -> None:
        self._bank = stamp_bank(diameter_px, core, blur_px)
        self._strength = None if strength is None else np.rint(256 * strength).astype(np.int32)
        self._map = np.empty((HEIGHT_PX, WIDTH_PX), np.uint8)

    def paint(self, xy_px: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Return the map for marker centres (N, 2), valid until the next call, without markers outside the image."""
        strength = np.full(len(xy_px), 256, np.int32) if self._strength is None else self._strength
        self._map.fill(255)
        stamp(self._map, self._bank, np.clip(xy_px, -_FAR_PX, _FAR_PX), strength)
        return self._map


@njit(cache=True)  # type: ignore[untyped-decorator]
def stamp(
    cover: NDArray[np.uint8], bank: NDArray[np.uint8], xy_px: NDArray[np.float64], strength: NDArray[np.int32]
) -> None:
    """Darken `cover` (H, W) by markers at `xy_px` (N, 2), with `strength` (N,) 256ths of their ink."""
    height, width = cover.shape
    size = bank.shape[3]
    for n in range(len(xy_px)):
        fine_x, fine_y = round((xy_px[n, 0] + 0.5) * PHASES), round((xy_px[n, 1] + 0.5) * PHASES)
        left, top = fine_x // PHASES - size // 2, fine_y // PHASES - size // 2
        own = bank[fine_y % PHASES, fine_x % PHASES]
        ink = strength[n]
        for i in range(max(-top, 0), min(size, height - top)):
            for j in range(max(-left, 0), min(size, width - left)):
                clear = 255 - (((255 - own[i, j]) * ink) >> 8)
                if clear < cover[top + i, left + j]:
                    cover[top + i, left + j] = clear
