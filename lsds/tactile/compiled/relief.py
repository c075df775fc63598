"""Compiled arithmetic of the relief: `lsds.tactile.imprint.relief` row by row, without planes in between."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lsds.support.jit import compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Plane = NDArray[np.float32]
    Index = NDArray[np.int32]


class Axis(NamedTuple):
    """The light's blocks along one axis of `n` pixels.

    `blocks` is their number. Pixel i lies in `block[i]` (n,) with `share[i]`, and in the next with the rest. The light
    on it lies `part[i]` of the way from the centre of block `left[i]` to that of the next.
    """

    blocks: int
    block: Index
    share: Plane
    left: Index
    part: Plane


@lru_cache(maxsize=16)
def axis(count: int, block_px: int) -> Axis:
    """Return the blocks of about `block_px` along `count` pixels."""
    blocks = max(1, count // block_px)
    width, pixel = count / blocks, np.arange(count)
    block = np.minimum(np.floor(pixel / width + _ROUNDING), blocks - 1)
    share = np.clip((block + 1) * width - pixel, 0, 1)
    share[share > 1 - _ROUNDING] = 1
    at = np.clip((pixel + 0.5) / width - 0.5, 0, blocks - 1)
    left = np.floor(at)
    return Axis(
        blocks,
        block.astype(np.int32),
        share.astype(np.float32),
        left.astype(np.int32),
        (at - left).astype(np.float32),
    )


#: Rounding errors of a position in blocks.
_ROUNDING = 1e-6


class CurvatureMaker:
    """Computes the curvature of reliefs; keeps its buffer between frames."""

    def __init__(self, slopes: Plane, taps: Plane, bounds: Plane, block_px: int) -> None:
        """Take the constants of `lsds.tactile.imprint.relief`.

        - `slopes` (2, 4): from the colours relative to the light, and one, to the slopes.
        - `taps` (4,): the smoothing of the slopes, from its end to its middle.
        - `bounds` (3,): the least light, free share of a block, and free share of a slope.
        - `block_px`: width of the light's blocks.
        """
        self._slopes, self._taps, self._bounds, self._block_px = slopes, taps, bounds, block_px
        self._rows = np.zeros((0, 0, 0), np.float32)

    def __call__(self, colours: tuple[NDArray[np.uint8], ...], free: NDArray[np.uint8]) -> Plane:
        """Return the curvature (h, w) of the planes (h, w) of an image, `free` (h, w) of markers."""
        height, width = free.shape
        padded = height + 2 * (len(self._taps) - 1)
        if self._rows.shape[1:] != (padded, width):
            self._rows = np.empty((3, padded, width), np.float32)
        along_x, along_y = axis(width, self._block_px), axis(height, self._block_px)
        curvature: Plane = curvature_of(
            *colours, free, self._slopes, self._taps, along_x, along_y, self._bounds, self._rows
        )
        return curvature


@compiled
def curvature_of(
    red: NDArray[np.uint8],
    green: NDArray[np.uint8],
    blue: NDArray[np.uint8],
    free: NDArray[np.uint8],
    slopes: Plane,
    taps: Plane,
    along_x: Axis,
    along_y: Axis,
    bounds: Plane,
    rows: Plane,
) -> Plane:
    """Return the curvature (h, w) of three colours, each (h, w), `free` (h, w) of markers.

    `slopes` (2, 4) are the rows of the photometric inverse, `taps` (4,) the smoothing from its end to its middle,
    `bounds` (3,) the least light, free share of a block, and free share of a slope; `rows` (3, h + 6, w) a buffer.
    """
    height, width = free.shape
    down, across = along_y.blocks, along_x.blocks
    block_y, share_y, left_y, part_y = along_y.block, along_y.share, along_y.left, along_y.part
    block_x, share_x, left_x, part_x = along_x.block, along_x.share, along_x.left, along_x.part
    least_light, least_free, least_seen = bounds[0], bounds[1], bounds[2]
    curvature = np.empty((height, width), np.float32)
    wide = np.empty((4, down, across), np.float32)
    one = np.float32(1)
    # Sums over the blocks, of the colours and of the free pixels: first along y, for all columns at once.
    light = np.zeros((down, across, 4), np.float32)
    sums = np.zeros((4, width), np.float32)
    for y in range(height):
        into, own = block_y[y], share_y[y]
        for x in range(width):
            w = own * np.float32(free[y, x] >> 7)
            sums[3, x] += w
            sums[0, x] += w * np.float32(red[y, x])
            sums[1, x] += w * np.float32(green[y, x])
            sums[2, x] += w * np.float32(blue[y, x])
        if y == height - 1 or block_y[y + 1] != into or own < one:
            for k in range(4):
                for x in range(width):
                    light[into, block_x[x], k] += share_x[x] * sums[k, x]
                    if share_x[x] < one:
                        light[into, block_x[x] + 1, k] += (one - share_x[x]) * sums[k, x]
            sums[:] = 0
            if own < one:
                for x in range(width):
                    w = (one - own) * np.float32(free[y, x] >> 7)
                    sums[3, x] += w
                    sums[0, x] += w * np.float32(red[y, x])
                    sums[1, x] += w * np.float32(green[y, x])
                    sums[2, x] += w * np.float32(blue[y, x])
    # Mean over the neighbouring blocks.
    line = np.empty((across, 4), np.float32)
    for v in range(down):
        above, own, below = light[min(abs(v - 1), down - 1)], light[v], light[max(down - 1 - abs(down - 2 - v), 0)]
        for b in range(across):
            for k in range(4):
                line[b, k] = above[b, k] + own[b, k] + below[b, k]
        for b in range(across):
            left, right = min(abs(b - 1), across - 1), max(across - 1 - abs(across - 2 - b), 0)
            for k in range(4):
                wide[k, v, b] = line[left, k] + line[b, k] + line[right, k]
    per = np.float32(across * down) / np.float32(9 * height * width)
    for v in range(down):
        for b in range(across):
            share = max(wide[3, v, b] * per, least_free)
            for k in range(3):
                wide[k, v, b] = max(wide[k, v, b] * per / share, least_light)
    # The light, linear between the blocks' centres: along x for each row of blocks.
    lit = np.empty((3, down, width), np.float32)
    for k in range(3):
        for v in range(down):
            for x in range(width):
                low = wide[k, v, left_x[x]]
                lit[k, v, x] = low + part_x[x] * (wide[k, v, min(left_x[x] + 1, across - 1)] - low)
    # Slopes, smoothed along x.
    weighted = np.empty((3, width + 6), np.float32)
    lr = np.empty((3, width), np.float32)
    t0, t1, t2, t3 = taps[0], taps[1], taps[2], taps[3]
    for y in range(height):
        v, part = left_y[y], part_y[y]
        below = min(v + 1, down - 1)
        for k in range(3):
            high, low, into = lit[k, v], lit[k, below], lr[k]
            colour = red[y] if k == 0 else (green[y] if k == 1 else blue[y])
            for x in range(width):
                into[x] = np.float32(colour[x]) / (high[x] + part * (low[x] - high[x]))
        mask, w = free[y], weighted[0, 3:]
        for x in range(width):
            w[x] = np.float32(mask[x] >> 7)
        for k in range(2):
            s0, s1, s2, s3 = slopes[k, 0], slopes[k, 1], slopes[k, 2], slopes[k, 3]
            r, g, b, to = lr[0], lr[1], lr[2], weighted[k + 1, 3:]
            for x in range(width):
                to[x] = w[x] * (s0 * r[x] + s1 * g[x] + s2 * b[x] + s3)
        for k in range(3):
            for d in range(1, 4):
                weighted[k, 3 - d] = weighted[k, 3 + d]
                weighted[k, width + 2 + d] = weighted[k, width + 2 - d]
            out = rows[k, y + 3]
            fr = weighted[k]
            for x in range(width):
                out[x] = (
                    t3 * fr[x + 3]
                    + t2 * (fr[x + 2] + fr[x + 4])
                    + t1 * (fr[x + 1] + fr[x + 5])
                    + t0 * (fr[x] + fr[x + 6])
                )
    for k in range(3):
        for d in range(1, 4):
            for x in range(width):
                rows[k, 3 - d, x] = rows[k, 3 + d, x]
                rows[k, height + 2 + d, x] = rows[k, height + 2 - d, x]
    # Smoothed along y, three rows at a time for the derivative.
    smooth = np.empty((2, 3, width), np.float32)
    seen = np.empty(width, np.float32)
    eighth = np.float32(0.125)
    two = np.float32(2)
    for y in range(height + 1):
        if y < height:
            into = y % 3
            for x in range(width):
                total = (
                    t3 * rows[0, y + 3, x]
                    + t2 * (rows[0, y + 2, x] + rows[0, y + 4, x])
                    + t1 * (rows[0, y + 1, x] + rows[0, y + 5, x])
                    + t0 * (rows[0, y, x] + rows[0, y + 6, x])
                )
                seen[x] = one / max(total, least_seen)
            for k in range(2):
                for x in range(width):
                    smooth[k, into, x] = seen[x] * (
                        t3 * rows[k + 1, y + 3, x]
                        + t2 * (rows[k + 1, y + 2, x] + rows[k + 1, y + 4, x])
                        + t1 * (rows[k + 1, y + 1, x] + rows[k + 1, y + 5, x])
                        + t0 * (rows[k + 1, y, x] + rows[k + 1, y + 6, x])
                    )
        if y == 0:
            continue
        mid = y - 1
        centre = mid % 3
        above = (mid - 1) % 3 if mid > 0 else 1 % 3
        below = y % 3 if y < height else (mid - 1) % 3
        for x in range(1, width - 1):
            curved_x = (
                (smooth[0, above, x + 1] - smooth[0, above, x - 1])
                + two * (smooth[0, centre, x + 1] - smooth[0, centre, x - 1])
                + (smooth[0, below, x + 1] - smooth[0, below, x - 1])
            )
            curved_y = (
                (smooth[1, below, x - 1] - smooth[1, above, x - 1])
                + two * (smooth[1, below, x] - smooth[1, above, x])
                + (smooth[1, below, x + 1] - smooth[1, above, x + 1])
            )
            curvature[mid, x] = eighth * (curved_x + curved_y)
        for x in (0, width - 1):
            beside = 1 if x == 0 else width - 2
            curved_y = two * (smooth[1, below, beside] - smooth[1, above, beside]) + two * (
                smooth[1, below, x] - smooth[1, above, x]
            )
            curvature[mid, x] = eighth * curved_y
    return curvature
