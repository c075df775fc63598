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
    """One resolution: `curvature` and `weight` (h, w), and `step`, the width of its pixels in relief pixels.

    `compiled` is whether its edges are chosen, and registered, by compiled functions.
    """

    def __init__(self, curvature: Plane, weight: Plane, step: float, most: int, *, compiled: bool = False) -> None:
        self.curvature, self.weight, self.step, self.compiled = curvature, weight, step, compiled
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
        if not self.compiled:
            table = _table(self, self._most)
            return Edges(table, _moments(table))
        from lsds.tactile.compiled.edges import edges

        return Edges(*edges(self.curvature, self.weight, self._most, np.float32(LEAST_WEIGHT)))

    def coarser(self, most: int) -> Layer:
        """Return the layer at half the resolution; its means exclude the markers."""
        share = cv2.pyrDown(self.weight)
        curvature = cv2.pyrDown(cv2.multiply(self.curvature, self.weight))
        curvature = cv2.divide(curvature, np.maximum(share, np.float32(_LEAST_EDGE_SHARE)))
        return Layer(
            np.asarray(curvature, np.float32),
            np.asarray(share, np.float32),
            2 * self.step,
            most,
            compiled=self.compiled,
        )


#: Lower bound of the free share by which the curvature of a coarser layer is divided; chosen.
_LEAST_EDGE_SHARE = 0.05


class Edges:
    """The steepest pixels of a layer.

    `table` (7, n) holds their position x and y, curvature, gradient along x and y, weight, and `squared`: the squared
    gradient times the weight. `total` is the sum of `squared`, with which `centre` (x, y) and radius of gyration are
    weighted; `weights` is the sum of the weights.
    """

    def __init__(self, table: Plane, moments: tuple[float, float, float, float, float]) -> None:
        self.table = table
        self.total, x, y, self.radius, self.weights = moments
        self.centre = (x, y)
        #: RMS gradient of these pixels.
        self.steepness = math.sqrt(self.total / max(table.shape[1], 1))

    def __len__(self) -> int:
        return int(self.table.shape[1])

    @property
    def x(self) -> Plane:
        """Positions (n,) along x."""
        return np.asarray(self.table[0])

    @property
    def y(self) -> Plane:
        """Positions (n,) along y."""
        return np.asarray(self.table[1])

    @property
    def curvature(self) -> Plane:
        """Curvature (n,)."""
        return np.asarray(self.table[2])

    @property
    def along(self) -> Plane:
        """Gradient (2, n) along x and y."""
        return np.asarray(self.table[3:5])

    @property
    def weight(self) -> Plane:
        """Weight (n,)."""
        return np.asarray(self.table[5])

    @property
    def squared(self) -> Plane:
        """Squared gradient (n,) times weight."""
        return np.asarray(self.table[6])


def _moments(table: Plane) -> tuple[float, float, float, float, float]:
    """Return the moments of edges (7, n): sum, mean x and y, and radius of `squared`, and the sum of the weights."""
    x, y, squared = table[0], table[1], table[6]
    total, weights = float(squared.sum()), float(table[5].sum())
    if total <= 0:
        return 0.0, 0.0, 0.0, 0.0, weights
    mean_x, mean_y = float(squared @ x) / total, float(squared @ y) / total
    spread = float(squared @ ((x - mean_x) ** 2 + (y - mean_y) ** 2))
    return total, mean_x, mean_y, math.sqrt(spread / total), weights


def _table(layer: Layer, most: int) -> Plane:
    """Return the table (7, n) of the `most` steepest pixels of a layer."""
    steepness, all_weights = layer.steepness.ravel(), layer.weight.ravel()
    index = np.flatnonzero(steepness > _bound(steepness, most) if steepness.size > most else steepness)
    weight = all_weights.take(index)
    if len(weight) and weight.min() <= LEAST_WEIGHT:
        index = index[weight > LEAST_WEIGHT]
        weight = all_weights.take(index)
    table = np.empty((7, len(index)), np.float32)
    table[1], table[0] = np.divmod(index, layer.weight.shape[1])
    for row, plane in zip(table[2:5], (layer.curvature, *layer.gradient), strict=True):
        plane.ravel().take(index, out=row)
    table[5] = weight
    steepness.take(index, out=table[6])
    return table


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

    def __init__(self, relief: Relief, *, compiled: bool = False) -> None:
        self._made = [Layer(relief.curvature, relief.weight, 1.0, EDGE_PIXELS[0], compiled=compiled)]

    def __getitem__(self, level: int) -> Layer:
        while len(self._made) <= level:
            self._made.append(self._made[-1].coarser(EDGE_PIXELS[len(self._made)]))
        return self._made[level]
