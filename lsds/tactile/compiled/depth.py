"""Compiled steps of the depth map, before and after the cosine transform (`lsds.tactile.depth`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds.support.jit import compiled

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Plane = NDArray[np.float32]
    Image = NDArray[np.uint8]


@compiled
def colours_of(
    red: Image, green: Image, blue: Image, free: Image, halvings: int, coarser: int, weight: np.float32
) -> Plane:
    """Return the colours (3, h, w) of three planes that are halved `halvings` times, where `free` of markers.

    A pixel that few free ones make takes its colour from up to `coarser` coarser levels, whose `weight` is relative to
    255 for a pixel that is all free. All are uint8 (h, w), as are the halved ones: the slopes' medians are steadier on
    whole grey levels.
    """
    height, width = free.shape
    level = np.empty((4, height, width), np.uint8)
    for y in range(height):
        own, r, g, b = free[y], red[y], green[y], blue[y]
        to_r, to_g, to_b, to_own = level[0, y], level[1, y], level[2, y], level[3, y]
        for x in range(width):
            to_own[x] = own[x]
        for x in range(width):
            to_r[x] = r[x] & own[x]
        for x in range(width):
            to_g[x] = g[x] & own[x]
        for x in range(width):
            to_b[x] = b[x] & own[x]
    for _ in range(halvings):
        level = _halved(level)
    filled: Plane = _filled(level, coarser, weight)
    return filled


@compiled
def _halved(level: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the means (n, h, w) of 2 x 2 pixels."""
    planes, height, width = level.shape[0], level.shape[1] // 2, level.shape[2] // 2
    halved = np.empty((planes, height, width), np.uint8)
    for k in range(planes):
        for v in range(height):
            upper, lower, to = level[k, 2 * v], level[k, 2 * v + 1], halved[k, v]
            for u in range(width):
                total = np.int32(upper[2 * u]) + np.int32(upper[2 * u + 1]) + np.int32(lower[2 * u])
                to[u] = np.uint8((total + np.int32(lower[2 * u + 1]) + np.int32(2)) >> np.int32(2))
    return halved


@compiled
def _filled(level: NDArray[np.uint8], coarser: int, weight: np.float32) -> Plane:
    """Return the colours (3, h, w) of a level (4, h, w) of sums of colours and the free share."""
    _, height, width = level.shape
    colours = np.empty((3, height, width), np.float32)
    whole, one = np.float32(255), np.float32(1)
    if coarser == 0:
        for k in range(3):
            for v in range(height):
                for u in range(width):
                    colours[k, v, u] = np.float32(level[k, v, u]) * (whole / max(np.float32(level[3, v, u]), one))
        return colours
    down, across = height // 2, width // 2
    around = _filled(_halved(level), coarser - 1, weight)
    near, far, part = np.float32(0.75), np.float32(0.25), weight / whole
    row = np.empty(across, np.float32)
    for v in range(height):
        own, other = v // 2, min(max(v // 2 + (1 if v % 2 else -1), 0), down - 1)
        for k in range(3):
            close, beyond, to, free = around[k, own], around[k, other], colours[k, v], level[3, v]
            for u in range(across):
                row[u] = part * (near * close[u] + far * beyond[u])
            for u in range(across):
                to[2 * u] = near * row[u] + far * row[max(u - 1, 0)]
                to[2 * u + 1] = near * row[u] + far * row[min(u + 1, across - 1)]
            shown = level[k, v]
            for u in range(width):
                to[u] = (to[u] + np.float32(shown[u])) * (whole / (np.float32(free[u]) + weight))
    return colours


@compiled
def slopes_of(
    colours: Plane, reference: Plane, sampled: Plane, inverse: Plane, every: int, least_gain: np.float32
) -> Plane:
    """Return the slopes (2, h, w) along x and y of colours (3, h, w) against the `reference` (3, h, w).

    `sampled` (3, n) are the reference's colours at every `every`-th pixel; the median ratio to them is the gain, and
    `inverse` (2, 3, h, w) the photometric one.
    """
    _, height, width = colours.shape
    slopes = np.empty((2, height, width), np.float32)
    ratio = np.empty(sampled.shape[1], np.float32)
    change = np.empty((3, height, width), np.float32)
    for k in range(3):
        i = 0
        for v in range(1, height, every):
            for u in range(1, width, every):
                ratio[i] = colours[k, v, u] / sampled[k, i]
                i += 1
        gain = np.float32(1) / max(np.partition(ratio, i // 2)[i // 2], least_gain)
        for v in range(height):
            for u in range(width):
                change[k, v, u] = colours[k, v, u] * gain - reference[k, v, u]
    for k in range(2):
        for v in range(height):
            for u in range(width):
                slopes[k, v, u] = (
                    inverse[k, 0, v, u] * change[0, v, u]
                    + inverse[k, 1, v, u] * change[1, v, u]
                    + inverse[k, 2, v, u] * change[2, v, u]
                )
        some = slopes[k].ravel()[::3].copy()
        middle = np.partition(some, some.size // 2)[some.size // 2]
        for v in range(height):
            for u in range(width):
                slopes[k, v, u] -= middle
    return slopes


@compiled
def level_depth(depth: Plane, free: int, threshold_m: np.float32, free_level: float, block: int) -> float:
    """Set the zero of a depth map (h, w) in place; return the share of the pad that is deeper than the threshold.

    `free` is the number of pixels that are taken as free of contact, `free_level` the quantile of all free ones that
    is the level of the flat gel, and `block` how many times finer than the map the contact's edge is found.
    """
    height, width = depth.shape
    flat = depth.ravel()
    flat -= np.partition(flat, free)[free]
    above = flat[flat < threshold_m]
    if above.size:
        at = int(free_level * above.size)
        flat -= np.partition(above, at)[at]
    half = np.float32(0.5)
    rows = np.empty((height, width * block), np.float32)
    for v in range(height):
        row, to = depth[v], rows[v]
        for s in range(block):
            # Offset of the fine pixel from the middle of the coarse one, in coarse pixels.
            part = (np.float32(s) + half) / np.float32(block) - half
            for u in range(width):
                beside = row[max(u - 1, 0)] if part < 0 else row[min(u + 1, width - 1)]
                to[u * block + s] = row[u] + abs(part) * (beside - row[u])
    count = 0.0
    for v in range(height):
        for s in range(block):
            part = (np.float32(s) + half) / np.float32(block) - half
            own, beside = rows[v], rows[max(v - 1, 0)] if part < 0 else rows[min(v + 1, height - 1)]
            part = abs(part)
            inside = 0
            for x in range(width * block):
                inside += own[x] + part * (beside[x] - own[x]) > threshold_m
            count += inside
    return float(count / (height * block * width * block))
