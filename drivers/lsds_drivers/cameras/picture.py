"""Convert a camera's picture to the tactile image: crop, rotate, mirror, resize."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import cv2
import numpy as np

from lsds.errors import DataError

if TYPE_CHECKING:
    from numpy.typing import NDArray

Turn = Literal[0, 90, 180, 270]
Flip = Literal["none", "horizontal", "vertical", "both"]

_TURNS = {90: cv2.ROTATE_90_CLOCKWISE, 180: cv2.ROTATE_180, 270: cv2.ROTATE_90_COUNTERCLOCKWISE}
_FLIPS = {"horizontal": 1, "vertical": 0, "both": -1}
_DECODING_FACTORS = (8, 4, 2)
"""Factors by which libjpeg can reduce a picture while it decodes it, largest first."""


@dataclass(frozen=True, slots=True)
class Crop:
    """What to crop: `border` as a share of each side, then `left`, `top`, `right`, `bottom` in px."""

    border: float = 0.0
    left: int = 0
    top: int = 0
    right: int = 0
    bottom: int = 0


@dataclass(frozen=True, slots=True)
class Picture:
    """Crops, then rotates (clockwise, degrees), mirrors, swaps red and blue, and resizes to (width, height)."""

    width: int
    height: int
    crop: Crop = Crop()
    turn: Turn = 0
    flip: Flip = "none"
    swap_red_blue: bool = False

    def reduction(self, width: int, height: int) -> int:
        """Return by how much a JPEG of that size may be decoded smaller without losing what the result needs."""
        if any((self.crop.left, self.crop.top, self.crop.right, self.crop.bottom)):
            return 1  # pixels were counted at full size
        inner_width, inner_height = self._inner(width, height)
        need = (self.width, self.height) if self.turn % 180 == 0 else (self.height, self.width)
        return next((f for f in _DECODING_FACTORS if inner_width >= f * need[0] and inner_height >= f * need[1]), 1)

    def of(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the tactile picture, a new uint8 RGB array (height, width, 3).

        Raises DataError if the camera's picture is too small after cropping.
        """
        crop = self.crop
        rows, columns = image.shape[:2]
        x, y = int(columns * crop.border), int(rows * crop.border)
        inner = image[y + crop.top : rows - y - crop.bottom, x + crop.left : columns - x - crop.right]
        need = (self.width, self.height) if self.turn % 180 == 0 else (self.height, self.width)
        if inner.shape[1] < need[0] / 2 or inner.shape[0] < need[1] / 2:
            raise DataError(
                f"the image has {inner.shape[1]} x {inner.shape[0]} px after cropping ({columns} x {rows} from the "
                f"camera), too few for {need[0]} x {need[1]}: crop less, or raise the camera's resolution"
            )
        if (inner.shape[1], inner.shape[0]) != need:
            shrinking = inner.shape[1] > need[0] and inner.shape[0] > need[1]
            inner = np.asarray(
                cv2.resize(inner, need, interpolation=cv2.INTER_AREA if shrinking else cv2.INTER_LINEAR), np.uint8
            )
        if self.turn:
            inner = np.asarray(cv2.rotate(inner, _TURNS[self.turn]), np.uint8)
        if self.flip != "none":
            inner = np.asarray(cv2.flip(inner, _FLIPS[self.flip]), np.uint8)
        if self.swap_red_blue:
            inner = inner[..., ::-1]
        # A contiguous copy, so that keeping it does not keep the camera's whole picture in memory.
        return np.array(inner, np.uint8, order="C")

    def _inner(self, width: int, height: int) -> tuple[int, int]:
        border = self.crop.border
        return width - 2 * int(width * border), height - 2 * int(height * border)
