"""Gather the dense compliance of the cells in contact from the layer's table and the pad's correction.

`compliance[i, a, b, j]` is what traction a (0 x, 1 y, 2 pressure) in cell i does to displacement b of cell j; it is
symmetric under (i, a) <-> (j, b), and a cell's three columns lie side by side, as the sweep reads them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

_TILE = 16


@njit(cache=True)  # type: ignore[untyped-decorator]
def hats_of(
    row: float, column: float, rows: int, columns: int, node: NDArray[np.int64], weight: NDArray[np.float64]
) -> None:
    """Write the four hats around a place, given in hat intervals from the pad's corner, and their values there."""
    r, c = min(max(int(row), 0), rows - 1), min(max(int(column), 0), columns - 1)
    y, x = min(max(row - r, 0.0), 1.0), min(max(column - c, 0.0), 1.0)
    first = r * (columns + 1) + c
    node[0], weight[0] = first, (1 - y) * (1 - x)
    node[1], weight[1] = first + 1, (1 - y) * x
    node[2], weight[2] = first + columns + 1, y * (1 - x)
    node[3], weight[3] = first + columns + 2, y * x


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def gather(
    compliance: NDArray[np.float32],
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    known: int,
    count: int,
    table: NDArray[np.float32],
) -> None:
    """Fill the rows `known` to `count` from the table, up to the diagonal."""
    ny, nx = table.shape[2], table.shape[3]
    flat = table.reshape(3, 3, ny * nx)
    at = np.zeros(count, np.int64)
    for i in range(known, count):
        for j in range(i + 1):
            dr, dc = rows[j] - rows[i], columns[j] - columns[i]
            at[j] = (dr + ny if dr < 0 else dr) * nx + (dc + nx if dc < 0 else dc)
        for a in range(3):
            for b in range(3):
                t, out = flat[b, a], compliance[i, a, b]
                for j in range(i + 1):
                    out[j] = t[at[j]]


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def correct(
    compliance: NDArray[np.float32],
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    known: int,
    count: int,
    correction: NDArray[np.float32],
    fine: int,
    hat_rows: int,
    hat_columns: int,
) -> None:
    """Add the pad's correction, (3, nodes, 3, nodes) in metres per pascal in a cell, to the rows `known` to `count`, up
    to the diagonal."""
    # Numbers without a sign are not checked for being negative, and columns are read one after another.
    place, share = np.zeros((4, count), np.uint32), np.zeros((4, count), np.float32)
    node, weight = np.zeros(4, np.int64), np.zeros(4)
    number, needed, many = np.full(correction.shape[1], -1), np.zeros(correction.shape[1], np.uint32), 0
    for i in range(count):
        hats_of((rows[i] + 0.5) / fine, (columns[i] + 0.5) / fine, hat_rows, hat_columns, node, weight)
        for h in range(4):
            if number[node[h]] < 0:
                number[node[h]], needed[many] = many, node[h]
                many += 1
            place[h, i], share[h, i] = number[node[h]], weight[h]
    p0, p1, p2, p3 = place
    w0, w1, w2, w3 = share
    at_node = np.zeros((3, many), np.float32)
    for i in range(known, count):
        for a in range(3):
            s0, s1 = correction[a, needed[p0[i]]], correction[a, needed[p1[i]]]
            s2, s3 = correction[a, needed[p2[i]]], correction[a, needed[p3[i]]]
            for b in range(3):
                s, out = at_node[b], compliance[i, a, b]
                for k in range(many):
                    n = needed[k]
                    s[k] = w0[i] * s0[b, n] + w1[i] * s1[b, n] + w2[i] * s2[b, n] + w3[i] * s3[b, n]
                for j in range(i + 1):
                    out[j] += w0[j] * s[p0[j]] + w1[j] * s[p1[j]] + w2[j] * s[p2[j]] + w3[j] * s[p3[j]]


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def mirror(compliance: NDArray[np.float32], known: int, count: int) -> None:
    """Fill what lies beyond the diagonal in the columns `known` to `count` from the rows that they mirror, a tile at a
    time, so that each line of the cache is fetched once."""
    for i0 in range(known, count, _TILE):
        i1 = min(i0 + _TILE, count)
        for j0 in range(0, i1, _TILE):
            j1 = min(j0 + _TILE, i1)
            for a in range(3):
                for b in range(3):
                    for j in range(j0, j1):
                        out = compliance[j, b, a]
                        for i in range(max(i0, j + 1), i1):
                            out[i] = compliance[i, a, b, j]


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def point_correction(
    out: NDArray[np.float32],
    node: NDArray[np.int64],
    weight: NDArray[np.float32],
    correction: NDArray[np.float32],
) -> None:
    """Write (3, nodes, 2 M): the correction from hats to points, each read from hats `node` with `weight` (M, K)."""
    points, many = node.shape
    for a in range(3):
        for n in range(correction.shape[1]):
            for b in range(2):
                source, own = correction[a, n, b], out[a, n]
                for m in range(points):
                    value = np.float32(0.0)
                    for h in range(many):
                        value += weight[m, h] * source[node[m, h]]
                    own[b * points + m] = value


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def point_rows(
    out: NDArray[np.float32],
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    rows: NDArray[np.int32],
    columns: NDArray[np.int32],
    table: NDArray[np.float32],
    from_hats: NDArray[np.float32],
    fine: int,
    point_fine: int,
    hat_rows: int,
    hat_columns: int,
) -> None:
    """Write (N, 3, 2 M): what tractions in cells do to points `x`, `y` (M,), in hat intervals from the pad's corner.

    `from_hats` is `point_correction`'s answer, of size 0 where there is none.
    """
    ny, nx = table.shape[2], table.shape[3]
    points = x.size
    node, weight = np.zeros(4, np.int64), np.zeros(4)
    one = np.float32(1.0)
    for i in range(rows.size):
        cy, cx = (rows[i] + 0.5) / fine, (columns[i] + 0.5) / fine
        for m in range(points):
            oy, ox = (y[m] - cy) * point_fine, (x[m] - cx) * point_fine
            r, c = int(np.floor(oy)), int(np.floor(ox))
            fy, fx = np.float32(oy - r), np.float32(ox - c)
            r0, r1, c0, c1 = r % ny, (r + 1) % ny, c % nx, (c + 1) % nx
            for a in range(3):
                for b in range(2):
                    t = table[b, a]
                    value = (one - fy) * ((one - fx) * t[r0, c0] + fx * t[r0, c1])
                    value += fy * ((one - fx) * t[r1, c0] + fx * t[r1, c1])
                    out[i, a, b * points + m] = value
        if from_hats.size:
            hats_of(cy, cx, hat_rows, hat_columns, node, weight)
            for h in range(4):
                w = np.float32(weight[h])
                for a in range(3):
                    source, own = from_hats[a, node[h]], out[i, a]
                    for k in range(2 * points):
                        own[k] += w * source[k]


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def displace(
    out: NDArray[np.float32], rows: NDArray[np.float32], which: NDArray[np.int64], traction: NDArray[np.float32]
) -> None:
    """Add up what cells `which` of `rows` (., 3, 2 M) do under `traction` (3, N) into `out` (2 M,)."""
    out[:] = 0.0
    for i in range(which.size):
        row = rows[which[i]]
        tx, ty, p = traction[0, i], traction[1, i], traction[2, i]
        if tx == 0.0 and ty == 0.0 and p == 0.0:
            continue
        for m in range(out.size):
            out[m] += tx * row[0, m] + ty * row[1, m] + p * row[2, m]
