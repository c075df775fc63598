"""Compiled registration of one layer: `lsds.tactile.imprint.registration` without tables per step."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lsds.support.jit import compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray


@compiled
def places_of(
    table: NDArray[np.float32], nodes: NDArray[np.float32], per_node: float, scale: float, c_x: float, c_y: float
) -> tuple[NDArray[np.float32], float]:
    """Return where the gel carries the edges (2, n), about the centre (`c_x`, `c_y`), and their radius of gyration.

    `table` (7, n) are the edges, `nodes` (rows, columns, 2) the motion of the gel in image px; `scale` is the width of
    a pixel in image px, and `per_node` that width in nodes.
    """
    count = table.shape[1]
    rows, columns, _ = nodes.shape
    places = np.empty((2, count), np.float32)
    total = 0.0
    for i in range(count):
        x, y = table[0, i], table[1, i]
        u = min(max(x * per_node, 0.0), columns - 1.0)
        v = min(max(y * per_node, 0.0), rows - 1.0)
        left, top = min(int(u), columns - 2), min(int(v), rows - 2)
        a, b = u - left, v - top
        for k in range(2):
            upper = nodes[top, left, k] + a * (nodes[top, left + 1, k] - nodes[top, left, k])
            lower = nodes[top + 1, left, k] + a * (nodes[top + 1, left + 1, k] - nodes[top + 1, left, k])
            moved = (upper + b * (lower - upper)) / scale
            places[k, i] = moved + (x - c_x if k == 0 else y - c_y)
        total += places[0, i] * places[0, i] + places[1, i] * places[1, i]
    return places, math.sqrt(total / max(count, 1)) + 1.0


@compiled
def registered(
    table: NDArray[np.float32],
    places: NDArray[np.float32],
    curvature: NDArray[np.float32],
    weight: NDArray[np.float32],
    centre: tuple[float, float],
    start: tuple[float, float, float],
    prior: NDArray[np.float64],
    outlier: float,
    radius: float,
    limits: tuple[int, float, float, float, float],
    known: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the registration (29,) of the edges on a second layer from a start; `known` is that at the start, if any.

    It holds slip x, y (px of the layer), turn, gain, the normal equations (4, 5), and the sums of weights and squares:
    the first relief's, the product's, the second's, the difference's, the weights'. `limits` are the number of steps,
    the length of a step that settles, the longest step, the least and the largest gain.
    """
    most, settled, longest, least_gain, largest_gain = limits
    x, y, turn = start
    gain = compared_at = 1.0
    normal = np.empty((4, 5))
    sums = np.empty(5)
    full = np.empty((4, 5))
    if known.size:
        normal[:] = known[4:24].reshape(4, 5)
        sums[:] = known[24:]
    else:
        _compare(table, places, curvature, weight, centre, x, y, turn, gain, outlier, normal, sums)
    for _ in range(most):
        cos, sin = math.cos(turn), math.sin(turn)
        full[:] = normal
        full[0, 4] += prior[0] * (cos * x + sin * y)
        full[1, 4] += prior[1] * (cos * y - sin * x)
        full[2, 4] += prior[2] * turn
        full[3, 4] += prior[3] * (1.0 - gain)
        for k in range(4):
            full[k, k] += prior[k]
        _solve(full)
        gain = min(max(gain + full[3, 4], least_gain), largest_gain)
        d_x, d_y, d_turn = full[0, 4] / gain, full[1, 4] / gain, full[2, 4] / gain
        length = max(abs(d_x), abs(d_y), abs(d_turn) * radius)
        if length > longest:
            share = longest / length
            d_x, d_y, d_turn = d_x * share, d_y * share, d_turn * share
        turn -= d_turn
        cos, sin = math.cos(turn), math.sin(turn)
        x, y = x - (cos * d_x - sin * d_y), y - (sin * d_x + cos * d_y)
        if length < settled:
            break
        _compare(table, places, curvature, weight, centre, x, y, turn, gain, outlier, normal, sums)
        compared_at = gain
    # The last step changes the gain after the last comparison: its sums give the difference at the new gain.
    change = gain - compared_at
    own, both = sums[0], sums[1]
    sums[3] = max(sums[3] + change * (change * own - 2 * (both - compared_at * own)), 0.0)
    answer = np.empty(29)
    answer[0], answer[1], answer[2], answer[3] = x, y, turn, gain
    answer[4:24] = normal.ravel()
    answer[24:29] = sums
    return answer


@compiled
def _compare(
    table: NDArray[np.float32],
    places: NDArray[np.float32],
    curvature: NDArray[np.float32],
    weight: NDArray[np.float32],
    centre: tuple[float, float],
    x: float,
    y: float,
    turn: float,
    gain: float,
    outlier: float,
    normal: NDArray[np.float64],
    sums: NDArray[np.float64],
) -> None:
    """Write the normal equations (4, 5) and the sums (5,) of the reliefs' difference at the slipped edges."""
    height, width = curvature.shape
    cos, sin = np.float32(math.cos(turn)), np.float32(math.sin(turn))
    off_x, off_y = np.float32(centre[0] + x), np.float32(centre[1] + y)
    strength, bound = np.float32(gain), np.float32(outlier)
    n00 = n01 = n02 = n03 = n04 = n11 = n12 = n13 = n14 = n22 = n23 = n24 = n33 = n34 = np.float32(0)
    own = both = other = left = total = np.float32(0)
    one = np.float32(1)
    count = table.shape[1]
    shown, weights = np.empty(count, np.float32), np.empty(count, np.float32)
    places_x, places_y = places[0], places[1]
    for i in range(count):
        p, q = places_x[i], places_y[i]
        u, v = cos * p - sin * q + off_x, sin * p + cos * q + off_y
        if not (u > -1 and v > -1 and u < width and v < height):
            shown[i] = weights[i] = np.float32(0)
            continue
        column, row = math.floor(u), math.floor(v)
        a, b = u - np.float32(column), v - np.float32(row)
        if column >= 0 and row >= 0 and column < width - 1 and row < height - 1:
            upper = curvature[row, column] + a * (curvature[row, column + 1] - curvature[row, column])
            lower = curvature[row + 1, column] + a * (curvature[row + 1, column + 1] - curvature[row + 1, column])
            shown[i] = upper + b * (lower - upper)
            upper = weight[row, column] + a * (weight[row, column + 1] - weight[row, column])
            lower = weight[row + 1, column] + a * (weight[row + 1, column + 1] - weight[row + 1, column])
            weights[i] = upper + b * (lower - upper)
        else:
            # Beyond the image both are zero.
            seen, w = np.float32(0), np.float32(0)
            for down in range(2):
                for across in range(2):
                    r, c = row + down, column + across
                    if 0 <= r < height and 0 <= c < width:
                        share = (b if down else one - b) * (a if across else one - a)
                        seen += share * curvature[r, c]
                        w += share * weight[r, c]
            shown[i], weights[i] = seen, w
    firsts, along_x, along_y, own_weights = table[2], table[3], table[4], table[5]
    for i in range(count):
        p, q, first, g, h = places_x[i], places_y[i], firsts[i], along_x[i], along_y[i]
        seen, w = shown[i], weights[i] * own_weights[i]
        d = seen - strength * first
        trust = one + bound * d * d
        t = w / (trust * trust)
        r = h * p - g * q
        n00 += t * g * g
        n01 += t * g * h
        n02 += t * g * r
        n03 += t * g * first
        n04 += t * g * d
        n11 += t * h * h
        n12 += t * h * r
        n13 += t * h * first
        n14 += t * h * d
        n22 += t * r * r
        n23 += t * r * first
        n24 += t * r * d
        n33 += t * first * first
        n34 += t * first * d
        own += w * first * first
        both += w * seen * first
        other += w * seen * seen
        left += w * d * d
        total += w
    normal[0, 0], normal[0, 1], normal[0, 2], normal[0, 3], normal[0, 4] = n00, n01, n02, n03, n04
    normal[1, 0], normal[1, 1], normal[1, 2], normal[1, 3], normal[1, 4] = n01, n11, n12, n13, n14
    normal[2, 0], normal[2, 1], normal[2, 2], normal[2, 3], normal[2, 4] = n02, n12, n22, n23, n24
    normal[3, 0], normal[3, 1], normal[3, 2], normal[3, 3], normal[3, 4] = n03, n13, n23, n33, n34
    sums[0], sums[1], sums[2], sums[3], sums[4] = own, both, other, left, total


@compiled
def _solve(full: NDArray[np.float64]) -> None:
    """Solve the symmetric positive definite system (4, 4 | 1) in place; the solution is the last column."""
    for k in range(4):
        per = 1.0 / full[k, k]
        for j in range(k, 5):
            full[k, j] *= per
        for i in range(4):
            if i != k:
                factor = full[i, k]
                for j in range(k, 5):
                    full[i, j] -= factor * full[k, j]
