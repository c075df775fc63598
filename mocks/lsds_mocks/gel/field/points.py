"""How the pad's correction is read at points of the surface, such as dots, which lie anywhere between the hats."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.grid import HatGrid

_WIDTH = 4
"""Hats along an axis that a point is read from."""


def reading(
    hats: HatGrid, x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Return numbers and weights (M, 16) of the hats to read points (M,) from, in hat intervals from the corner."""
    column, across = _along(x, hats.columns)
    row, down = _along(y, hats.rows)
    node = row[:, :, None] * (hats.columns + 1) + column[:, None, :]
    weight = down[:, :, None] * across[:, None, :]
    return node.reshape(len(x), -1), weight.reshape(len(x), -1).astype(np.float32)


def _along(place: NDArray[np.float64], intervals: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return numbers and weights (M, 4) that read a cubic from its best fit by hats, c = f - f'' / 12 at each of them.

    With Lagrange's cubics L_k on four neighbouring hats, f = sum (L_k + L_k'' / 12) c_k. The fit itself is right in the
    mean over a cell, but not at a point: up to 2 % off for loads at a wall.
    """
    first = np.clip(np.floor(place).astype(np.int64) - 1, 0, intervals + 1 - _WIDTH)
    at = np.clip(place, 0, intervals) - first
    weight = np.empty((len(place), _WIDTH))
    for own in range(_WIDTH):
        polynomial = np.poly(np.delete(np.arange(_WIDTH), own))
        scale = np.polyval(polynomial, own)
        bend = np.polyder(polynomial, 2)
        weight[:, own] = (np.polyval(polynomial, at) + np.polyval(bend, at) / 12) / scale
    return first[:, None] + np.arange(_WIDTH), weight
