"""Compiled motion of the gel: `lsds.tactile.imprint.carrying.CarriedGel` without tables in between."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lsds.support.jit import compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray


@compiled
def nodes_of(
    position: NDArray[np.float64],
    moved: NDArray[np.float64],
    node_x: NDArray[np.float64],
    node_y: NDArray[np.float64],
    reach_px: float,
    affine_weight: float,
) -> NDArray[np.float32]:
    """Return the motion (rows, columns, 2) at the nodes, from markers at `position` (n, 2) that `moved` (n, 2), px."""
    count, columns, rows = len(position), len(node_x), len(node_y)
    x = y = m_x = m_y = 0.0
    for i in range(count):
        x += position[i, 0]
        y += position[i, 1]
        m_x += moved[i, 0]
        m_y += moved[i, 1]
    x, y, m_x, m_y = x / count, y / count, m_x / count, m_y / count
    # Markers in one line do not determine the motion across it.
    xx, yy, xy = 1.0, 1.0, 0.0
    x_x = x_y = y_x = y_y = 0.0
    for i in range(count):
        dx, dy = position[i, 0] - x, position[i, 1] - y
        xx += dx * dx
        yy += dy * dy
        xy += dx * dy
        x_x += dx * moved[i, 0]
        x_y += dx * moved[i, 1]
        y_x += dy * moved[i, 0]
        y_y += dy * moved[i, 1]
    both = xx * yy - xy * xy
    a_x, b_x = (yy * x_x - xy * y_x) / both, (xx * y_x - xy * x_x) / both
    a_y, b_y = (yy * x_y - xy * y_y) / both, (xx * y_y - xy * x_y) / both
    per = -0.5 / (reach_px * reach_px)
    near_x = np.empty((columns, count))
    for c in range(columns):
        for i in range(count):
            offset = node_x[c] - position[i, 0]
            near_x[c, i] = math.exp(per * offset * offset)
    rest_x, rest_y = np.empty(count), np.empty(count)
    for i in range(count):
        dx, dy = position[i, 0] - x, position[i, 1] - y
        rest_x[i] = moved[i, 0] - m_x - a_x * dx - b_x * dy
        rest_y[i] = moved[i, 1] - m_y - a_y * dx - b_y * dy
    nodes = np.empty((rows, columns, 2), np.float32)
    near, by_x, by_y = np.empty(count), np.empty(count), np.empty(count)
    for r in range(rows):
        for i in range(count):
            offset = node_y[r] - position[i, 1]
            near[i] = math.exp(per * offset * offset)
            by_x[i] = near[i] * rest_x[i]
            by_y[i] = near[i] * rest_y[i]
        for c in range(columns):
            beside = near_x[c]
            total, sum_x, sum_y = affine_weight, 0.0, 0.0
            for i in range(count):
                total += beside[i] * near[i]
                sum_x += beside[i] * by_x[i]
                sum_y += beside[i] * by_y[i]
            dx, dy = node_x[c] - x, node_y[r] - y
            nodes[r, c, 0] = sum_x / total + m_x + a_x * dx + b_x * dy
            nodes[r, c, 1] = sum_y / total + m_y + a_y * dx + b_y * dy
    return nodes
