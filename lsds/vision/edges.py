"""A square marker's corners from its four sides, to hundredths of a pixel.

Where two edges meet at a corner, blur rounds it, and a search for the corner itself ends inside it: by 0.2 px at a blur
of 0.6 px, which makes the marker smaller and so farther away. The side of a square has no such bias, because blur is
the same on both sides of a straight edge. So each side is located by the centroid of the grey gradient across it, at
many places; a line is fitted; neighbours are intersected.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

_ENDS = 0.13
"""Share of a side left out at each end, where the next side's blur reaches in."""
_STEP_PX = 0.5
_WIDEST_PX = 4.0
_MODULES = 12.0
"""Half a module of the smallest markers, by which neither the pattern inside nor the paper's rim is reached."""
_FLOOR = 0.1
_ROUNDS = 2
_SHORTEST_PX, _LEAST_PLACES = 8, 4
_PARALLEL = 0.1
"""Sine of the angle between neighbours below which they do not meet."""


def refined_corners(grey: NDArray[np.uint8], corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners (4, 2) of a dark square on light paper, found near `corners` in a grey picture.

    Corners come back unchanged where no such edges are found within a twelfth of the side.
    """
    found = corners
    for _ in range(_ROUNDS):
        refined = _once(grey, found)
        if refined is None:
            return corners
        found = refined
    side = float(np.linalg.norm(corners - np.roll(corners, -1, axis=0), axis=1).mean())
    moved = float(np.linalg.norm(found - corners, axis=1).max())
    return found if moved < max(1.5, side / _MODULES) else corners


def prepare() -> None:
    """Load what is compiled, or compile it: not in the first picture's time."""
    refined_corners(np.zeros((32, 32), np.uint8), np.array([[8.0, 8.0], [24.0, 8.0], [24.0, 24.0], [8.0, 24.0]]))


def _once(grey: NDArray[np.uint8], corners: NDArray[np.float64]) -> NDArray[np.float64] | None:
    outward, half, count = _sides(corners)
    if count == 0:
        return None
    columns, rows = _places(corners, outward, half, count)
    profiles = cv2.remap(grey, columns, rows, cv2.INTER_LINEAR)
    found = np.empty((4, 2))
    return found if _located(profiles, corners, outward, half, found) else None


@njit(cache=True)  # type: ignore[untyped-decorator]
def _sides(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], float, int]:
    """Return the unit normals (4, 2) of the sides, outward; how far to look to each side of them (px); and at how many
    places along each, 0 where one is too short."""
    outward = np.empty((4, 2))
    whole, shortest = 0.0, math.inf
    middle_x, middle_y = corners[:, 0].mean(), corners[:, 1].mean()
    for i in range(4):
        dx, dy = corners[(i + 1) % 4, 0] - corners[i, 0], corners[(i + 1) % 4, 1] - corners[i, 1]
        length = math.sqrt(dx * dx + dy * dy)
        whole, shortest = whole + length, min(shortest, length)
        if length > 0.0:
            side = dy * (corners[i, 0] - middle_x) - dx * (corners[i, 1] - middle_y)
            outward[i, 0] = np.sign(side) * dy / length
            outward[i, 1] = -np.sign(side) * dx / length
    mean = whole / 4
    count = max(8, int(mean * (1 - 2 * _ENDS))) if shortest >= _SHORTEST_PX else 0
    return outward, min(_WIDEST_PX, mean / _MODULES), count


@njit(cache=True)  # type: ignore[untyped-decorator]
def _foot(corners: NDArray[np.float64], side: int, k: int, count: int) -> tuple[float, float]:
    """Return the place number `k` of `count` on a side, between its ends."""
    share = _ENDS + (1 - 2 * _ENDS) * k / (count - 1)
    x, y = corners[side, 0], corners[side, 1]
    return x + share * (corners[(side + 1) % 4, 0] - x), y + share * (corners[(side + 1) % 4, 1] - y)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _places(
    corners: NDArray[np.float64], outward: NDArray[np.float64], half: float, count: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return columns and rows (4 count, across), side by side, where the picture is looked up."""
    across = math.ceil((2 * half + _STEP_PX / 2) / _STEP_PX)
    columns = np.empty((4 * count, across), np.float32)
    rows = np.empty((4 * count, across), np.float32)
    for side in range(4):
        for k in range(count):
            x, y = _foot(corners, side, k, count)
            for j in range(across):
                away = -half + j * _STEP_PX
                columns[side * count + k, j] = x + away * outward[side, 0]
                rows[side * count + k, j] = y + away * outward[side, 1]
    return columns, rows


@njit(cache=True)  # type: ignore[untyped-decorator]
def _located(
    profiles: NDArray[np.uint8],
    corners: NDArray[np.float64],
    outward: NDArray[np.float64],
    half: float,
    found: NDArray[np.float64],
) -> bool:
    """Write the corners (4, 2) from what the picture shows across the sides; tell whether there are any."""
    count = len(profiles) // 4
    edge, weight = _edges(profiles, half)
    usable = weight > 0.5 * np.median(weight)
    point, normal = np.zeros((4, 2)), np.zeros((4, 2))
    for side in range(4):
        taken, xx, xy, yy = 0, 0.0, 0.0, 0.0
        at = np.empty((count, 2))
        for k in range(count):
            number = side * count + k
            if not usable[number]:
                continue
            x, y = _foot(corners, side, k, count)
            at[taken, 0], at[taken, 1] = x + edge[number] * outward[side, 0], y + edge[number] * outward[side, 1]
            point[side] += at[taken]
            taken += 1
        if taken < _LEAST_PLACES:
            return False
        point[side] /= taken
        # The line with the least squared distances to these points.
        for k in range(taken):
            x, y = at[k, 0] - point[side, 0], at[k, 1] - point[side, 1]
            xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
        angle = 0.5 * math.atan2(2 * xy, xx - yy)
        normal[side, 0], normal[side, 1] = -math.sin(angle), math.cos(angle)
    for side in range(4):
        before = (side + 3) % 4
        (a, b), (c, d) = normal[before], normal[side]
        determinant = a * d - b * c
        if abs(determinant) < _PARALLEL:
            return False
        e = point[before, 0] * a + point[before, 1] * b
        f = point[side, 0] * c + point[side, 1] * d
        found[side, 0], found[side, 1] = (e * d - b * f) / determinant, (a * f - e * c) / determinant
    return True


@njit(cache=True)  # type: ignore[untyped-decorator]
def _edges(profiles: NDArray[np.uint8], half: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how far out (n,) the centroid of the rise from ink to paper lies (px), and how much it rises (n,)."""
    count, across = profiles.shape
    edge, weight = np.zeros(count), np.zeros(count)
    rise = np.empty(across - 1)
    for i in range(count):
        for j in range(across - 1):
            # From ink to paper it gets lighter outward; anything else is another edge.
            rise[j] = max(0.0, float(profiles[i, j + 1]) - float(profiles[i, j]))
        least = _FLOOR * rise.max()
        for j in range(across - 1):
            if rise[j] >= least:
                weight[i] += rise[j]
                edge[i] += rise[j] * (-half + (j + 0.5) * _STEP_PX)
        edge[i] /= max(weight[i], 1e-6)
    return edge, weight
