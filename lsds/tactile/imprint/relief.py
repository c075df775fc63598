"""Relief of the gel's surface under an object: fine edges and grain, without markers, lighting and gentle slopes.

The lamps' colours encode the direction of a slope, so an edge that turns changes its colours. The relief is therefore
the surface's curvature: the divergence of the slopes from photometric stereo (Johnson and Adelson 2009), which rotation
does not change. Gentle slopes vanish in it. The light on a pixel is estimated from its surroundings between the
markers. The relief needs no reference frame, so it also shows an object that is held from the first frame on.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np

from lsds.tactile.depth import PhotometricCalibration
from lsds.tactile.views import HALF, ViewedFrame, smaller, viewed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts import Frame

    Plane = NDArray[np.float32]

#: Maximum width of the relief, px: finer detail is noise of camera and codec.
WIDEST = 240
#: Width of the blocks whose means, with those of the neighbours, are the light around a pixel; relief px.
LIGHT_BLOCK_PX = 8
#: Minimum light of the surroundings, grey levels. Darker ones get this value, or their noise would look like relief.
LEAST_LIGHT_LEVEL = 8.0
#: Grey level of the light for which the photometric calibration holds.
CALIBRATED_LIGHT = 100.0
#: Standard deviation of the slopes' smoothing, relief px.
SMOOTH = 1.5
#: Window of the slopes' smoothing, relief px.
SLOPE_WINDOW_PX = (7, 7)
#: Level of a colour from which a pixel is saturated and has no slope, grey levels.
SATURATED = 247
#: Maximum share of saturated pixels. In an over-exposed image noise decides which pixels are saturated, and their rims
#: look like edges.
MOST_SATURATED = 0.25
#: Width of the border that has no curvature for lack of neighbours, relief px.
BORDER_PX = 3
_NONE = np.zeros((0, 2))


class Relief(NamedTuple):
    """Curvature (h, w) in slope per relief pixel, and the weight (h, w) of each pixel: 1 on the gel, 0 on markers.

    `scale` is the width of a relief pixel in image pixels.
    """

    curvature: Plane
    weight: Plane
    scale: float


class ReliefMaker:
    """Makes reliefs by a photometric calibration. Compiled functions share a buffer: use it from one thread."""

    def __init__(self, calibration: PhotometricCalibration | None = None, *, compiled: bool = False) -> None:
        """If `compiled`, compiled functions compute the reliefs and everything that follows from them."""
        inverse = (calibration or PhotometricCalibration()).inverse() * CALIBRATED_LIGHT
        # The relative light is 1 without slope. The last column subtracts the contribution of this 1.
        self._slopes = [np.array([[*shares, -shares.sum()]], np.float32) for shares in inverse.T]
        self.compiled = compiled
        self._curvature = self._portable_curvature
        if compiled:
            from lsds.tactile.compiled.relief import CurvatureMaker

            taps = cv2.getGaussianKernel(SLOPE_WINDOW_PX[0], SMOOTH)[: SLOPE_WINDOW_PX[0] // 2 + 1, 0]
            bounds = np.array([LEAST_LIGHT_LEVEL, LEAST_FREE, LEAST_FREE_SHARE], np.float32)
            self._curvature = CurvatureMaker(
                np.concatenate(self._slopes), taps.astype(np.float32), bounds, LIGHT_BLOCK_PX
            )

    def relief(self, frame: Frame, faint_px: NDArray[np.float64] = _NONE, radius_px: float = 0.0) -> Relief:
        """Return the relief of a frame. Discs around `faint_px` (n, 2) are excluded, as markers are."""
        views = viewed(frame)
        colours, (dots, scale) = self._colours(views), _at_most(WIDEST, views.dark, cv2.INTER_NEAREST)
        if len(faint_px):
            dots = _with_discs(dots, smaller(faint_px, scale), radius_px / scale)
        # A marker's soft rim is darker than the gel but not in the mask.
        free = np.asarray(cv2.bitwise_not(cv2.dilate(dots, _ROUND)), np.uint8)
        if max(int(part.max()) for part in colours) >= SATURATED:
            free = np.asarray(cv2.bitwise_and(free, _unsaturated(colours)), np.uint8)
        curvature = self._curvature(colours, free)
        weight = _unit(np.asarray(cv2.erode(free, _AROUND), np.uint8))
        for edge in (weight[:BORDER_PX], weight[-BORDER_PX:], weight[:, :BORDER_PX], weight[:, -BORDER_PX:]):
            edge[:] = 0
        return Relief(curvature, weight, scale)

    def _colours(self, views: ViewedFrame) -> tuple[NDArray[np.uint8], ...]:
        """Return an image (h, w, 3) at half resolution or less, or its planes (h, w) for compiled functions."""
        parts = views.half_planes if self.compiled else (views.half_rgb,)
        return tuple(_at_most(WIDEST, part, cv2.INTER_AREA)[0] for part in parts)

    def _portable_curvature(self, colours: tuple[NDArray[np.uint8], ...], free: NDArray[np.uint8]) -> Plane:
        """Return the curvature (h, w) of an image (h, w, 3), `free` (h, w) of markers."""
        (image,) = colours
        weight = _unit(free)
        # Processing all three colours at once takes half the time.
        relative = cv2.copyTo(image, free).astype(np.float32)
        cv2.divide(relative, _light(relative, weight), dst=relative)
        seen = cv2.GaussianBlur(weight, SLOPE_WINDOW_PX, SMOOTH)
        np.maximum(seen, np.float32(LEAST_FREE_SHARE), out=seen)
        parts = []
        for shares, along in zip(self._slopes, ((1, 0), (0, 1)), strict=True):
            slope = cv2.transform(relative, shares)
            cv2.multiply(slope, weight, dst=slope)
            slope = cv2.GaussianBlur(slope, SLOPE_WINDOW_PX, SMOOTH)
            cv2.divide(slope, seen, dst=slope)
            parts.append(cv2.Sobel(slope, cv2.CV_32F, *along, ksize=3, scale=1 / 8))
        return np.asarray(cv2.add(parts[0], parts[1], dst=parts[0]), np.float32)


def _at_most(widest: int, image: NDArray[np.uint8], how: int) -> tuple[NDArray[np.uint8], float]:
    """Return an image at half resolution, halved further until it is no wider than that, and its scale."""
    scale = HALF
    while image.shape[1] > widest:
        image = np.asarray(cv2.resize(image, (image.shape[1] // 2, image.shape[0] // 2), interpolation=how), np.uint8)
        scale *= 2
    return image, float(scale)


def _with_discs(dots: NDArray[np.uint8], places: NDArray[np.float64], radius: float) -> NDArray[np.uint8]:
    """Return a mask of markers (h, w) with discs added at `places` (n, 2), px."""
    dots = dots.copy()
    for x, y in np.round(places * _SIXTEEN).astype(int).tolist():
        cv2.circle(dots, (x, y), round(radius * _SIXTEEN), 255, -1, shift=4)
    return dots


def _unsaturated(colours: tuple[NDArray[np.uint8], ...]) -> NDArray[np.uint8]:
    """Return the mask (h, w) of pixels without a saturated colour nearby; empty if the image is over-exposed."""
    usable = np.full(colours[0].shape[:2], 255, np.uint8)
    for part in colours:
        bound = (SATURATED - 1,) * (part.shape[2] if part.ndim == 3 else 1)
        usable &= np.asarray(cv2.inRange(part, (0,) * len(bound), bound), np.uint8)
    if cv2.countNonZero(usable) < (1 - MOST_SATURATED) * usable.size:
        usable[:] = 0
    return np.asarray(cv2.erode(usable, _ROUND), np.uint8)


def _light(shown: NDArray[np.float32], weight: Plane) -> NDArray[np.float32]:
    """Return the light (h, w, 3) of each colour: the mean of the free pixels nearby, smooth over several blocks.

    `shown` (h, w, 3) are the colours; they are zero where `weight` (h, w) is zero.
    """
    height, width = weight.shape
    size = (max(1, width // LIGHT_BLOCK_PX), max(1, height // LIGHT_BLOCK_PX))
    bright = cv2.blur(cv2.resize(shown, size, interpolation=cv2.INTER_AREA), (3, 3))
    share = cv2.blur(cv2.resize(weight, size, interpolation=cv2.INTER_AREA), (3, 3))
    np.maximum(share, np.float32(LEAST_FREE), out=share)
    mean = cv2.divide(bright, cv2.merge([share, share, share]), dst=bright)
    np.maximum(mean, np.float32(LEAST_LIGHT_LEVEL), out=mean)
    return np.asarray(cv2.resize(mean, (width, height), interpolation=cv2.INTER_LINEAR), np.float32)


def _unit(mask: NDArray[np.uint8]) -> Plane:
    return np.right_shift(mask, 7).astype(np.float32)


#: Fractions of a pixel in OpenCV's coordinates with a shift of 4 bits.
_SIXTEEN = 16
#: Share of free pixels below which a smoothed slope fades.
LEAST_FREE_SHARE = 0.02
#: Share of free pixels below which the light of a block fades.
LEAST_FREE = LIGHT_BLOCK_PX / 255
_ROUND = np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5)), np.uint8)
_AROUND = np.ones((3, 3), np.uint8)
