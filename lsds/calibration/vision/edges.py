"""A square marker's corners from its four sides, to hundredths of a pixel.

Blur rounds a corner, so a direct search ends inside it: by 0.2 px at a blur of 0.6 px, which makes the marker appear
smaller and so farther away. A side has no such bias, because blur is the same on both sides of a straight edge.
Therefore the centroid of the grey gradient across a side locates it at many places; a line is fitted to these, and
neighbouring lines are intersected.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_ENDS = 0.13
"""Share of a side that is ignored at each end because of the next side's blur."""
_PROFILE_STEP_PX = 0.5
"""Distance of the samples across an edge, px; chosen."""
_WIDEST_EDGE_PX = 4.0
"""Maximum distance of samples from an edge, px; chosen."""
_MODULES = 12.0
"""Half a module of the smallest markers, by which neither the pattern inside nor the paper's rim is reached."""
_CONTRAST_FLOOR = 0.1
"""Rise of the light below which a sample is ignored, as a share of the greatest rise of its profile; chosen."""
_ROUNDS = 2
"""Number of refinements, each from the corners of the last; chosen."""
_SHORTEST_PX = 8
"""Minimum length of a side, px; chosen."""
_LEAST_PLACES = 4
"""Minimum number of profiles of a side that show the edge; chosen."""
_PARALLEL = 0.1
"""Sine of the angle between neighbours below which they do not meet."""
_BEFORE, _AHEAD = np.array([3, 0, 1, 2]), np.array([1, 2, 3, 0])


def refined_corners(grey: NDArray[np.uint8], corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners (4, 2) of a dark square on light paper, found near `corners` in a grey picture.

    Returns the corners unchanged if there are no such edges within a twelfth of the side.
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


def _once(grey: NDArray[np.uint8], corners: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """One round, with x + iy for a point: a turn is a product, and the sums of a line's squares are those of one."""
    corner = np.ascontiguousarray(corners).view(np.complex128)[:, 0]
    side = corner[_AHEAD] - corner
    lengths = np.abs(side)
    if lengths.min() < _SHORTEST_PX:
        return None
    outward = -1j * side / lengths
    outward *= np.sign((outward.conj() * (corner - corner.sum() / 4)).real)
    mean = float(lengths.sum()) / 4
    half = min(_WIDEST_EDGE_PX, mean / _MODULES)
    across = np.arange(-half, half + _PROFILE_STEP_PX / 2, _PROFILE_STEP_PX)
    shares = np.linspace(_ENDS, 1 - _ENDS, max(8, int(mean * (1 - 2 * _ENDS))))
    feet = corner[:, None] + side[:, None] * shares
    places = (feet[..., None] + outward[:, None, None] * across).reshape(-1, len(across))
    columns, rows = places.real.astype(np.float32), places.imag.astype(np.float32)
    profiles = cv2.remap(grey, columns, rows, cv2.INTER_LINEAR).astype(np.float32)
    # From ink to paper it gets lighter outward; anything else is another edge.
    rise = np.maximum(profiles[:, 1:] - profiles[:, :-1], 0)
    rise[rise < _CONTRAST_FLOOR * rise.max(axis=1, keepdims=True)] = 0
    weight, moment = (rise @ np.stack([np.ones(len(across) - 1), across[:-1] + _PROFILE_STEP_PX / 2], axis=1)).T
    edge = (moment / np.maximum(weight, 1e-6)).reshape(feet.shape)
    usable = (weight > 0.5 * np.partition(weight, len(weight) // 2)[len(weight) // 2]).reshape(feet.shape)
    taken = np.count_nonzero(usable, axis=1)
    if taken.min() < _LEAST_PLACES:
        return None
    # The line with the least squared distances to those places of a side that are usable.
    points = (feet + edge * outward[:, None]) * usable
    middle = points.sum(axis=1) / taken
    apart = (points - middle[:, None]) * usable
    normal = 1j * np.exp(0.5j * np.angle((apart * apart).sum(axis=1)))
    # Where each line meets the one before it.
    distance = (normal.conj() * middle).real
    before, before_distance = normal[_BEFORE], distance[_BEFORE]
    sine = (before.conj() * normal).imag
    if np.abs(sine).min() < _PARALLEL:
        return None
    found = 1j * (distance * before - before_distance * normal) / sine
    return np.asarray(found.view(np.float64).reshape(4, 2))
