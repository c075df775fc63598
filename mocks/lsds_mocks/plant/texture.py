"""Friction that varies over an object's surface and travels with it.

During gross slip the patch continuously moves onto new surface, which makes the markers tremble. The map is a sum of
smooth random fields of several correlation lengths, periodic along the object's length.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

TEXTURE_LENGTHS_M = (0.3e-3, 1.0e-3, 3.0e-3, 8.0e-3, 20.0e-3)
"""Correlation lengths of the random fields, m; chosen."""
TEXTURE_SHARES = (0.3, 0.4, 0.5, 0.5, 0.5)
"""Standard deviation of each scale, relative to the whole after normalising."""
ROW_M = 0.05e-3
"""Pitch of the map's rows, along the object, m; chosen."""
COLUMN_M = 0.25e-3
"""Pitch of the map's columns, across the object, m; chosen."""
WIDTH_M = 24.0e-3
"""Width of the map across the object, m; chosen, points beyond it take the map's edge."""


class Texture:
    """A relative friction map: mean 1, standard deviation `amplitude`, cut at three of them."""

    def __init__(self, length_m: float, amplitude: float, rng: np.random.Generator) -> None:
        rows, columns = max(64, round(length_m / ROW_M)), round(WIDTH_M / COLUMN_M)
        total = np.zeros((rows, columns), np.float32)
        for scale, share in zip(TEXTURE_LENGTHS_M, TEXTURE_SHARES, strict=True):
            total += np.float32(share) * _field(rows, columns, scale, rng)
        total *= np.float32(1 / np.hypot.reduce(TEXTURE_SHARES))
        self._map = 1.0 + np.clip(amplitude * total.astype(np.float64), -3 * amplitude, 3 * amplitude)
        self._rows, self._columns = rows, columns
        self._flat = self._map.ravel()

    def row(self, travel_m: float) -> int:
        """Return the row of the map that corresponds to a travel."""
        return round(travel_m / ROW_M)

    def index(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.intp]:
        """Return flat indices of surface points at zero travel; y runs down, along the object."""
        column = np.clip(np.rint(x_m / COLUMN_M + self._columns / 2), 0, self._columns - 1).astype(np.intp)
        row = np.rint(y_m / ROW_M).astype(np.intp) % self._rows
        return row * self._columns + column

    def at(self, index: NDArray[np.intp], travel_m: float, out: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the factors under the points after the object moved `travel_m` along +y against them."""
        shift = -self.row(travel_m) % self._rows * self._columns
        return np.take(self._flat, index + shift, mode="wrap", out=out)


class Chatter:
    """A random function of travel alone, with unit variance, equal under the whole patch.

    Soft gels slide in waves of detachment, which independent bristles cannot show. The markers' motion looks as if the
    kinetic friction of the whole patch rose and fell while the object travels.
    """

    LENGTHS_M = (0.6e-3, 2.0e-3, 6.0e-3)
    SHARES = (0.5, 0.7, 0.5)

    def __init__(self, length_m: float, rng: np.random.Generator) -> None:
        rows = max(64, round(length_m / ROW_M))
        total = np.zeros(rows, np.float64)
        for scale, share in zip(self.LENGTHS_M, self.SHARES, strict=True):
            total += share * _field(rows, 1, scale, rng)[:, 0]
        self._values: list[float] = (total / np.hypot.reduce(self.SHARES)).tolist()

    def at(self, travel_m: float) -> float:
        """Return the value after a travel, linear between the map's rows."""
        row = travel_m / ROW_M
        low = math.floor(row)
        share, size = row - low, len(self._values)
        return (1 - share) * self._values[low % size] + share * self._values[(low + 1) % size]


def _field(rows: int, columns: int, scale_m: float, rng: np.random.Generator) -> NDArray[np.float32]:
    """A smooth unit-variance field, periodic in rows: white noise on a grid of the scale, cubically interpolated."""
    coarse = max(4, round(rows * ROW_M / scale_m))
    noise = rng.standard_normal((coarse, max(1, round(columns * COLUMN_M / scale_m)))).astype(np.float32)
    across = cv2.resize(noise, (columns, coarse), interpolation=cv2.INTER_CUBIC)
    at = np.arange(rows) * (coarse / rows)
    low = np.floor(at).astype(np.intp)
    t = (at - low).astype(np.float32)[:, None]
    weights = (-t + 2 * t**2 - t**3, 2 - 5 * t**2 + 3 * t**3, t + 4 * t**2 - 3 * t**3, t**3 - t**2)
    field = np.zeros((rows, columns), np.float32)
    for k, weight in enumerate(weights):
        field += 0.5 * weight * across[(low + k - 1) % coarse]
    return np.asarray((field - field.mean()) / field.std(), np.float32)
