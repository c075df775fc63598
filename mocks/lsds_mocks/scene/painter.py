"""Paints moving cards into a picture with lens projection and motion blur.

Each pixel is the mean of eight samples, spread over both its area and the exposure. The exact projection gives the
point at which each ray meets the card. Edges are therefore smooth, motion blurs, and nothing snaps to the pixel grid:
these pictures serve to measure corners that move by a hundredth of a pixel.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np

from lsds_mocks.byte_cache import kept
from lsds_mocks.scene.lens import Rays

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.calibration.vision.camera import CameraModel
    from lsds_mocks.scene.cards import Card

#: Samples of a pixel, spread over its area and the exposure; chosen.
PIXEL_SAMPLES = 8
#: Margin of the painted window around the corners of a card, px; chosen.
_OUTLINE_MARGIN_PX = 3
_ONE_MAP = np.zeros(0, np.float32)
Seen = Callable[[float], tuple["NDArray[np.float64]", "NDArray[np.float64]"]]
"""Function from a fraction (0..1) of the exposure to camera <- card: rotation (3, 3), position (3,)."""


class Layer(NamedTuple):
    """A rendered card: its window in the picture, the uncovered fraction of each pixel, the grey levels it adds."""

    window: tuple[slice, slice]
    free: NDArray[np.float32]
    grey: NDArray[np.float32]

    def onto(self, image: NDArray[np.float32]) -> None:
        """Composite it over a grey float32 picture (height, width), in place."""
        part = image[self.window]
        part *= self.free
        part += self.grey


class Painter:
    """Paints for one camera."""

    def __init__(self, camera: CameraModel) -> None:
        self._camera = camera
        self._rays = Rays(camera)
        # Every column and row of eighths is used once, and samples that are close in space are apart in time.
        across = np.arange(PIXEL_SAMPLES)
        order = (across * 7 + 3) % PIXEL_SAMPLES
        self._offsets = np.stack([(across + 0.5) / PIXEL_SAMPLES - 0.5, (order + 0.5) / PIXEL_SAMPLES - 0.5], axis=1)
        self._instants = (((across * 5 + 1) % PIXEL_SAMPLES) + 0.5) / PIXEL_SAMPLES

    def paint(self, image: NDArray[np.float32], card: Card, seen: Seen) -> None:
        """Paint a card over a grey float32 picture (height, width) in place; a card out of view changes nothing."""
        layer = self.layer(card, seen)
        if layer is not None:
            layer.onto(image)

    def layer(self, card: Card, seen: Seen) -> Layer | None:
        """Return the rendered card; None if it is out of view."""
        window = self._window(card, seen)
        if window is None:
            return None
        # Over one pixel and one exposure the map from ray to texel is linear to a thousandth of a texel.
        middle, begin, end = (self._texels(card, window, *seen(instant)) for instant in (0.5, 0.0, 1.0))
        across, down, onward = np.gradient(middle, axis=1), np.gradient(middle, axis=0), end - begin
        sheet = _sheet(card)
        total = np.zeros((*middle.shape[:2], 2), np.float32)
        for (du, dv), instant in zip(self._offsets.tolist(), self._instants.tolist(), strict=True):
            at = middle + np.float32(du) * across + np.float32(dv) * down + np.float32(instant - 0.5) * onward
            sample = cv2.remap(sheet, at, _ONE_MAP, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
            cv2.accumulate(sample, total)
        free = np.asarray(1 - total[..., 1] / (255 * PIXEL_SAMPLES), np.float32)
        return Layer(window, free, np.asarray(total[..., 0] / PIXEL_SAMPLES, np.float32))

    def _texels(
        self, card: Card, window: tuple[slice, slice], rotation: NDArray[np.float64], position: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """Return the points (rows, columns, 2) at which the pixels' rays meet the card, in texels (column, row)."""
        plane = _to_texels(card, rotation, position)
        x, y = self._rays.x[window], self._rays.y[window]
        u, v, w = (plane[i, 0] * x + plane[i, 1] * y + plane[i, 2] for i in range(3))
        return np.stack([u / w, v / w], axis=-1).astype(np.float32)

    def _window(self, card: Card, seen: Seen) -> tuple[slice, slice] | None:
        pixels = []
        for share in (0.0, 1.0):
            rotation, position = seen(share)
            corners = card.corners_m @ rotation.T + position
            if (corners[:, 2] <= 1e-3).any():
                return None
            flat, _ = cv2.projectPoints(corners, np.zeros(3), np.zeros(3), self._camera.matrix, self._camera.distortion)
            pixels.append(flat.reshape(-1, 2))
        low = np.floor(np.concatenate(pixels).min(axis=0)).astype(int) - _OUTLINE_MARGIN_PX
        high = np.ceil(np.concatenate(pixels).max(axis=0)).astype(int) + _OUTLINE_MARGIN_PX + 1
        width, height = self._camera.size
        (left, top), (right, bottom) = np.clip(low, 0, (width, height)), np.clip(high, 0, (width, height))
        if right <= left or bottom <= top:
            return None
        # The window of a card at the picture's border is one row or column larger, to obtain the texels' gradient.
        left, top = min(left, width - 2), min(top, height - 2)
        return slice(int(top), int(max(bottom, top + 2))), slice(int(left), int(max(right, left + 2)))


@kept
def _sheet(card: Card) -> NDArray[np.uint8]:
    """Return the card's picture with a mask of the card as the second channel."""
    return np.dstack([card.texture, np.full_like(card.texture, 255)])


def _to_texels(card: Card, rotation: NDArray[np.float64], position: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the homography (3, 3) from ray directions (x/z, y/z, 1) to texels (column, row, 1), up to a factor that is
    positive in front of the camera."""
    onto_card = np.linalg.inv(np.stack([rotation[:, 0], rotation[:, 1], position], axis=1))
    scale = card.texels_per_m
    texels = np.array([[scale, 0, card.origin[0]], [0, -scale, card.origin[1]], [0, 0, 1.0]])
    return np.asarray(texels @ onto_card, np.float64)
