"""Printed cards: flat bodies with a picture, in which one texel has a known length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

TEXELS_PER_MM = 6
"""Resolution of a card's picture, texels per millimetre; chosen."""
PAPER_LEVEL = 225
"""Grey level of paper under the cell's light."""
CARDBOARD_LEVEL = 118
"""Grey level of cardboard under the cell's light."""
TONER_LEVEL = 18
"""Grey level of toner under the cell's light."""


@dataclass(frozen=True, slots=True, eq=False)
class Card:
    """A flat picture, uint8 grey (rows, columns), and the texel (column, row) of its frame's origin.

    The frame: x right, y up, z towards the viewer. Texel centres lie at integers.
    """

    texture: NDArray[np.uint8]
    origin: tuple[float, float]
    texels_per_m: float = TEXELS_PER_MM * 1e3

    @property
    def corners_m(self) -> NDArray[np.float64]:
        """Return the corners (4, 3) in the card's frame."""
        rows, columns = self.texture.shape
        edges = [(-0.5, -0.5), (columns - 0.5, -0.5), (columns - 0.5, rows - 0.5), (-0.5, rows - 0.5)]
        return np.array(
            [((c - self.origin[0]) / self.texels_per_m, (self.origin[1] - r) / self.texels_per_m, 0) for c, r in edges]
        )


def marker_card(
    number: int, size_mm: float, *, dictionary: str, width_mm: float, height_mm: float, marker_at_mm: float
) -> Card:
    """Return a grey card with a marker on white paper; its frame's origin is the marker's centre.

    `marker_at_mm` is the distance of the marker's centre from the card's top; it is centred horizontally.
    """
    found = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{dictionary}"))
    modules = found.markerSize + 2
    per_module = round(size_mm * TEXELS_PER_MM / modules)
    side = per_module * modules
    marker = cv2.aruco.generateImageMarker(found, number, side, borderBits=1)
    texture = np.full((round(height_mm * TEXELS_PER_MM), round(width_mm * TEXELS_PER_MM)), CARDBOARD_LEVEL, np.uint8)
    left = (texture.shape[1] - side) // 2
    top = round(marker_at_mm * TEXELS_PER_MM) - side // 2
    quiet = per_module
    texture[top - quiet : top + side + quiet, left - quiet : left + side + quiet] = PAPER_LEVEL
    texture[top : top + side, left : left + side] = np.where(marker > 0, PAPER_LEVEL, TONER_LEVEL)
    return Card(texture, (left + (side - 1) / 2, top + (side - 1) / 2))
