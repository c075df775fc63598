"""Compiled choice of a relief's edges, as `lsds.tactile.imprint.layers.Edges` makes it, without gradient images."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lsds.support.jit import compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray


@compiled
def edges(
    curvature: NDArray[np.float32], weight: NDArray[np.float32], most: int, least_weight: np.float32
) -> tuple[NDArray[np.float32], tuple[float, float, float, float, float]]:
    """Return the edges of a layer (h, w) as a table (7, n), and their moments, as `lsds.tactile.imprint.layers.Edges`.

    `most` is the number of pixels wanted, and `least_weight` that of a pixel that takes part.
    """
    height, width = curvature.shape
    steep = np.empty((height, width), np.float32)
    gradient_x, gradient_y = np.empty(width, np.float32), np.empty(width, np.float32)
    two, eighth = np.float32(2), np.float32(0.125)
    smooth, step = np.empty(width, np.float32), np.empty(width, np.float32)
    for y in range(height):
        here = curvature[y]
        above = curvature[y - 1] if y > 0 else curvature[min(1, height - 1)]
        below = curvature[y + 1] if y < height - 1 else curvature[max(height - 2, 0)]
        for x in range(width):
            smooth[x] = above[x] + two * here[x] + below[x]
        for x in range(width):
            step[x] = below[x] - above[x]
        to_x, to_y, own, to = gradient_x, gradient_y, weight[y], steep[y]
        for x in range(1, width - 1):
            to_x[x] = eighth * (smooth[x + 1] - smooth[x - 1])
        for x in range(1, width - 1):
            to_y[x] = eighth * (step[x - 1] + two * step[x] + step[x + 1])
        to_x[0] = to_x[width - 1] = np.float32(0)
        to_y[0] = eighth * two * (step[0] + step[1])
        to_y[width - 1] = eighth * two * (step[width - 1] + step[width - 2])
        for x in range(width):
            to[x] = (to_x[x] * to_x[x] + to_y[x] * to_y[x]) * own[x]
    flat, weights = steep.ravel(), weight.ravel()
    bound = _bound(flat, most) if flat.size > most else np.float32(0)
    # The number of every pixel is written, and that of a flat one overwritten: a branch would often be predicted
    # wrongly.
    at = np.empty(flat.size, np.int32)
    count = 0
    for i in range(flat.size):
        at[count] = i
        count += int((flat[i] > bound) & (weights[i] > least_weight))
    table = np.empty((7, count), np.float32)
    for k in range(count):
        y, x = at[k] // width, at[k] % width
        above, below = abs(y - 1), height - 1 - abs(height - 2 - y)
        left, right = abs(x - 1), width - 1 - abs(width - 2 - x)
        table[0, k], table[1, k], table[2, k] = x, y, curvature[y, x]
        upper, lower = curvature[above], curvature[below]
        table[3, k] = eighth * (
            (upper[right] - upper[left])
            + two * (curvature[y, right] - curvature[y, left])
            + (lower[right] - lower[left])
        )
        table[4, k] = eighth * (
            (lower[left] - upper[left]) + two * (lower[x] - upper[x]) + (lower[right] - upper[right])
        )
        table[5, k], table[6, k] = weights[at[k]], flat[at[k]]
    total = mean_x = mean_y = shown = 0.0
    for k in range(count):
        total += table[6, k]
        mean_x += table[6, k] * table[0, k]
        mean_y += table[6, k] * table[1, k]
        shown += table[5, k]
    if total > 0:
        mean_x, mean_y = mean_x / total, mean_y / total
    spread = 0.0
    for k in range(count):
        spread += table[6, k] * ((table[0, k] - mean_x) ** 2 + (table[1, k] - mean_y) ** 2)
    return table, (total, mean_x, mean_y, math.sqrt(spread / total) if total > 0 else 0.0, shown)


@compiled
def _bound(steep: NDArray[np.float32], most: int) -> np.float32:
    """Return the value that about `most` pixels exceed, from every fourth pixel."""
    some = steep[::4].copy()
    keep = max(1, most // 4)
    if some.size <= keep:
        return np.float32(0)
    mean = np.float32(some.mean())
    high, count = np.empty(some.size, np.float32), 0
    for i in range(some.size):
        high[count] = some[i]
        count += int(some[i] > mean)
    if count > keep:
        some = high[:count]
    return np.float32(np.partition(some, some.size - keep)[some.size - keep])
