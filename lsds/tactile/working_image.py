"""The image that perception works on: about 320 px wide, its colours in the order of the GelSight Mini's lamps.

Tracker, depth and imprint were tuned on images of that size, and their photometric calibration holds for that order of
the lamps. Both are measured from the reference. An image of another size or colour order is converted once, on entry.
A pad whose lamps shine from other sides needs its own photometric calibration.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations
from typing import TYPE_CHECKING

import cv2
import numpy as np

from lsds.tactile.depth import PhotometricCalibration

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import Frame

#: Width of a resized working image, px.
WIDTH_PX = 320
#: Minimum width of images that are not resized, px; chosen around the 320 px of the GelSight Mini.
NARROWEST_UNSCALED_PX = 280
#: Maximum width of images that are not resized, px; chosen around the 320 px of the GelSight Mini.
WIDEST_UNSCALED_PX = 480
#: Minimum width of images that are resized, px. Narrower ones show no markers, and the tracker refuses them.
LEAST_WIDTH_PX = 80
#: Minimum improvement of the fit to the reference's light for another order of the lamps. Fits of the orders differ by
#: 0.4 to 2.7; on 240 recordings of the GelSight Mini no wrong order fitted better by more than 0.12.
CLEARLY = 0.3
#: Minimum improvement of the fit by lamps turned by a quarter. On the first frames of 240 recordings of the GelSight
#: Mini they fit worse, by 0.12 at least; on the same turned by 90 degrees better, by 0.07 in 95 %.
QUARTER_TURN = 0.05
#: Order of the colour channels of an image that needs no change.
_AS_THEY_ARE = (0, 1, 2)
#: Width and height of the reduced images whose light is compared, px; chosen.
_COARSE = (40, 30)


class WorkingImage:
    """Converts the frames of one stream, as measured from its reference.

    `scale` is the width of a working pixel in camera pixels; `order` are the camera's colour channels that become red,
    green and blue.
    """

    def __init__(self, reference: Frame) -> None:
        height, width = reference.image.shape[:2]
        usual = NARROWEST_UNSCALED_PX <= width <= WIDEST_UNSCALED_PX
        self.scale = 1.0 if usual or width < LEAST_WIDTH_PX else width / WIDTH_PX
        self._size = round(width / self.scale), round(height / self.scale)
        self.order = lamp_order(reference.image)

    def frame(self, frame: Frame) -> Frame:
        """Return the frame with the working image: the same object if no conversion is needed."""
        if self.scale == 1.0 and self.order == _AS_THEY_ARE:
            return frame
        image = self.resized(frame.image)
        if self.order != _AS_THEY_ARE:
            image = np.ascontiguousarray(image[..., self.order])
        return replace(frame, image=image)

    def resized(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return a camera image in the size of the working image, with its colours unchanged."""
        if self.scale == 1.0:
            return image
        interpolation = cv2.INTER_AREA if self.scale > 1 else cv2.INTER_CUBIC
        return np.asarray(cv2.resize(image, self._size, interpolation=interpolation), np.uint8)


def lamp_order(image: NDArray[np.uint8], calibration: PhotometricCalibration | None = None) -> tuple[int, int, int]:
    """Return the channels (of 0, 1, 2) of an untouched gel's image that belong to a calibration's R, G, B lamps.

    A colour is brightest near its lamp, and a slope that faces the lamp brightens it. The result is the order in which
    the gradients of the colours' shares agree best with the calibration, but (0, 1, 2) unless another is clearly
    better.
    """
    fit = _fits(_gradient(image), _facing(calibration))
    best = max(fit, key=lambda order: fit[order])
    return (best[0], best[1], best[2]) if fit[best] > fit[_AS_THEY_ARE] + CLEARLY else _AS_THEY_ARE


def lamps_are_turned(image: NDArray[np.uint8], calibration: PhotometricCalibration | None = None) -> bool:
    """Return whether an untouched gel is lit as by a calibration's lamps turned by a quarter, in any order.

    An image turned by 90 degrees looks like this, and slopes measured from its colours are wrong.
    """
    gradient, facing = _gradient(image), _facing(calibration)
    upright, turned = (
        max(fit for sign in (1, -1) for fit in _fits(gradient, sign * sides).values())
        for sides in (facing, facing @ np.array([[0.0, 1.0], [-1.0, 0.0]]))
    )
    return turned > upright + QUARTER_TURN


def _gradient(image: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return the gradients (3, 2) of the colours' shares of an image, along x and y."""
    small = cv2.resize(image, _COARSE, interpolation=cv2.INTER_AREA).astype(np.float64)
    share = small / np.maximum(small.mean(axis=(0, 1)), 1.0)
    share /= np.maximum(share.mean(axis=2, keepdims=True), 1e-6)
    y, x = np.mgrid[: _COARSE[1], : _COARSE[0]]
    x, y = (x - (_COARSE[0] - 1) / 2) / _COARSE[0], (y - (_COARSE[1] - 1) / 2) / _COARSE[0]
    return np.array([np.tensordot(axis, share, 2) / (axis**2).sum() for axis in (x, y)]).T


def _facing(calibration: PhotometricCalibration | None) -> NDArray[np.float64]:
    """Return unit vectors (3, 2) towards the R, G and B lamps."""
    facing = -np.asarray((calibration or PhotometricCalibration()).levels_per_slope, float)
    return np.asarray(facing / np.linalg.norm(facing, axis=1, keepdims=True))


def _fits(gradient: NDArray[np.float64], facing: NDArray[np.float64]) -> dict[tuple[int, ...], float]:
    """Return how well the gradients of each order of the channels agree with the lamps."""
    return {order: float(np.sum(gradient[list(order)] * facing)) for order in permutations(_AS_THEY_ARE)}
