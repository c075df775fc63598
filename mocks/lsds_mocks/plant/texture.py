"""Friction that varies over an object's surface and travels with it.

What makes markers tremble during gross slip is that the patch meets new surface all the time. The map is a sum of
smooth random fields of several correlation lengths, periodic along the object's length.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

LENGTHS_M = (0.3e-3, 1.0e-3, 3.0e-3, 8.0e-3, 20.0e-3)
SHARES = (0.3, 0.4, 0.5, 0.5, 0.5)
"""Standard deviation of each scale, relative to the whole after normalising."""
ROW_M = 0.05e-3
COLUMN_M = 0.25e-3
WIDTH_M = 24.0e-3


class Texture:
    """A relative friction map: mean 1, standard deviation `amplitude`, cut at three of them."""

    def __init__(self, length_m: float, amplitude: float, rng: np.random.Generator) -> None:
        rows, columns = max(64, round(length_m / ROW_M)), round(WIDTH_M / COLUMN_M)
        total = np.zeros((rows, columns), np.float32)
        for scale, share in zip(LENGTHS_M, SHARES, strict=True):
            total += np.float32(share) * _field(rows, columns, scale, rng)
        total *= np.float32(1 / np.hypot.reduce(SHARES))
        self._map = 1.0 + np.clip(amplitude * total.astype(np.float64), -3 * amplitude, 3 * amplitude)
        self._rows, self._columns = rows, columns
        self._flat = self._map.ravel()

    def index(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.intp]:
        """Return flat indices of surface points at zero travel; y runs down, along the object."""
        column = np.clip(np.rint(x_m / COLUMN_M + self._columns / 2), 0, self._columns - 1).astype(np.intp)
        row = np.rint(y_m / ROW_M).astype(np.intp) % self._rows
        return row * self._columns + column

    def at(self, index: NDArray[np.intp], travel_m: float, out: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the factors under the points after the object moved `travel_m` along +y against them."""
        shift = (-round(travel_m / ROW_M)) % self._rows * self._columns
        return np.take(self._flat, index + shift, mode="wrap", out=out)


def _field(rows: int, columns: int, scale_m: float, rng: np.random.Generator) -> NDArray[np.float32]:
    """A smooth unit-variance field: white noise on a grid of the correlation length, interpolated."""
    coarse = (max(4, round(rows * ROW_M / scale_m)), max(2, round(columns * COLUMN_M / scale_m) + 1))
    noise = rng.standard_normal(coarse).astype(np.float32)
    noise = np.concatenate([noise, noise[:3]])  # wraps around, so that the map is periodic along the object
    height = round(rows * len(noise) / coarse[0])
    field = cv2.resize(noise, (columns, height), interpolation=cv2.INTER_CUBIC)[height - rows - 1 : height - 1]
    field = field[:rows]
    return np.asarray((field - field.mean()) / field.std(), np.float32)
