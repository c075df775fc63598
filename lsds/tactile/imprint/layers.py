"""A relief at several resolutions, and its edges: the pixels from which its motion is estimated."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from lsds.tactile.imprint.relief import Plane, Relief

#: Maximum number of edge pixels per layer, from the finest to the coarsest.
EDGE_PIXELS = (1500, 700, 300)
#: Number of resolutions.
COUNT = len(EDGE_PIXELS)
#: Weight of a pixel below which it lies on a marker.
LEAST_WEIGHT = 0.3


class Layer:
    """One resolution: `curvature` and `weight` (h, w), and `step`, the width of its pixels in relief pixels."""

    def __init__(self, curvature: Plane, weight: Plane, step: float, most: int) -> None:
        self.curvature, self.weight, self.step = curvature, weight, step
        self._most = most

    @cached_property
    def gradient(self) -> tuple[Plane, Plane]:
        """Gradient of the curvature along x and y, each (h, w), per pixel of the layer."""
        along = [cv2.Sobel(self.curvature, cv2.CV_32F, *axis, ksize=3, scale=1 / 8) for axis in ((1, 0), (0, 1))]
        return np.asarray(along[0], np.float32), np.asarray(along[1], np.float32)

    @cached_property
    def steepness(self) -> Plane:
        """Squared gradient (h, w), zero on markers: a pixel's information about motion."""
        along_x, along_y = self.gradient
        squared = cv2.multiply(along_x, along_x)
        squared = cv2.accumulateSquare(along_y, squared)
        return np.asarray(cv2.multiply(squared, self.weight, dst=squared), np.float32)

    @cached_property
    def edges(self) -> Edges:
        """The pixels with the most information about motion."""
        return Edges(self, self._most)

    def coarser(self, most: int) -> Layer:
        """Return the layer at half the resolution; its means exclude the markers."""
        share = cv2.pyrDown(self.weight)
        curvature = cv2.pyrDown(cv2.multiply(self.curvature, self.weight))
        curvature = cv2.divide(curvature, np.maximum(share, np.float32(_LEAST_EDGE_SHARE)))
        return Layer(np.asarray(curvature, np.float32), np.asarray(share, np.float32), 2 * self.step, most)


#: Lower bound of the free share by which the curvature of a coarser layer is divided; chosen.
_LEAST_EDGE_SHARE = 0.05


class Edges:
    """The `most` steepest pixels of a layer: positions `x`, `y`, curvature, gradient and weight, each (n,)."""

    def __init__(self, layer: Layer, most: int) -> None:
        steepness, all_weights = layer.steepness.ravel(), layer.weight.ravel()
        index = np.flatnonzero(steepness > _bound(steepness, most) if steepness.size > most else steepness)
        weight = all_weights.take(index)
        if len(weight) and weight.min() <= LEAST_WEIGHT:
            index = index[weight > LEAST_WEIGHT]
            weight = all_weights.take(index)
        row, column = np.divmod(index, layer.weight.shape[1])
        along_x, along_y = layer.gradient
        self.x, self.y = column.astype(np.float32), row.astype(np.float32)
        self.curvature = layer.curvature.ravel().take(index)
        self.weight = weight
        self.along_x, self.along_y = along_x.ravel().take(index), along_y.ravel().take(index)
        #: Squared gradient (n,) times weight.
        self.squared = steepness.take(index)
        #: RMS gradient of these pixels.
        self.steepness = math.sqrt(float(self.squared.sum()) / max(len(index), 1))


def _bound(steepness: Plane, most: int) -> np.float32:
    """Return the value of the steepness (n,) that about `most` pixels exceed."""
    # The bound comes from every fourth pixel: an exact one takes longer than a few pixels too many or too few.
    some = steepness[::4].copy()
    keep = max(1, most // 4)
    if some.size <= keep:
        return np.float32(0)
    # Most pixels are flat. Dropping those below the mean leaves less to sort and does not change the bound.
    steep = some.compress(some > cv2.mean(some)[0])
    if steep.size > keep:
        some = steep
    return np.float32(np.partition(some, -keep)[-keep])


class Layers:
    """The layers of a relief by number, the finest first; each is computed on first use."""

    def __init__(self, relief: Relief) -> None:
        self._made = [Layer(relief.curvature, relief.weight, 1.0, EDGE_PIXELS[0])]

    def __getitem__(self, level: int) -> Layer:
        while len(self._made) <= level:
            self._made.append(self._made[-1].coarser(EDGE_PIXELS[len(self._made)]))
        return self._made[level]
