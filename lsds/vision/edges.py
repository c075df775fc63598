"""The corners of a square marker from its four sides, to hundredths of a pixel.

Blur rounds a corner, so a corner search converges inside it: by 0.2 px at a blur of 0.6 px, which makes the marker
appear smaller and therefore farther away. A straight side has no such bias, because blur is the same on both sides of
the edge. Therefore each side is located at many points by the centroid of the grey gradient across it, a line is
fitted, and neighbouring lines are intersected.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_ENDS = 0.13
"""Fraction of a side ignored at each end, where the blur of the next side has an effect."""
_STEP_PX = 0.5
_WIDEST_PX = 4.0
_MODULES = 12.0
"""Half a module of the smallest markers, so that neither the pattern inside nor the edge of the paper is reached."""
_FLOOR = 0.1
_ROUNDS = 2
_BEFORE = np.array([3, 0, 1, 2])


def refined_corners(grey: NDArray[np.uint8], corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners (4, 2) of a dark square on light paper, found near `corners` in a grey picture.

    Corners are returned unchanged if no such edges are found within a twelfth of the side.
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
    ahead = np.roll(corners, -1, axis=0)
    lengths = np.linalg.norm(ahead - corners, axis=1)
    if lengths.min() < 8:
        return None
    along = (ahead - corners) / lengths[:, None]
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1)
    outward *= np.sign(np.einsum("ij,ij->i", outward, corners - corners.mean(axis=0)))[:, None]
    half = min(_WIDEST_PX, float(lengths.mean()) / _MODULES)
    across = np.arange(-half, half + _STEP_PX / 2, _STEP_PX)
    shares = np.linspace(_ENDS, 1 - _ENDS, max(8, int(lengths.mean() * (1 - 2 * _ENDS))))
    feet = corners[:, None, :] + shares[None, :, None] * (ahead - corners)[:, None, :]
    x, y = (feet[..., None, i] + across * outward[:, None, None, i] for i in (0, 1))
    columns, rows = (xy.astype(np.float32).reshape(-1, len(across)) for xy in (x, y))
    profiles = cv2.remap(grey, columns, rows, cv2.INTER_LINEAR).reshape(4, len(shares), -1).astype(np.float32)
    # From ink to paper the brightness increases outward; anything else is another edge.
    rise = np.maximum(profiles[..., 1:] - profiles[..., :-1], 0)
    rise[rise < _FLOOR * rise.max(axis=2, keepdims=True)] = 0
    weight = rise.sum(axis=2)
    middle = across[:-1] + _STEP_PX / 2
    edge = (rise * middle).sum(axis=2) / np.maximum(weight, 1e-6)
    usable = (weight > 0.5 * np.median(weight)).astype(np.float64)
    if usable.sum(axis=1).min() < 4:
        return None
    return _crossings(*_lines(feet + edge[..., None] * outward[:, None, :], usable))


def _lines(points: NDArray[np.float64], usable: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (points on them, unit normals), each (4, 2), of the lines with the least squared distances to those of
    points (4, n, 2) whose `usable` (4, n) is one, not zero."""
    mean = np.einsum("sn,sni->si", usable, points) / usable.sum(axis=1)[:, None]
    apart = (points - mean[:, None, :]) * usable[..., None]
    (xx, xy), (_, yy) = np.einsum("sni,snj->ijs", apart, apart)
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    return mean, np.stack([-np.sin(angle), np.cos(angle)], axis=1)


def _crossings(points: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return the intersection of each line with the previous one; None if two neighbours are almost parallel."""
    distances = np.einsum("si,si->s", points, normals)
    (a, b), (c, d) = normals[_BEFORE].T, normals.T
    determinant = a * d - b * c
    if np.abs(determinant).min() < 0.1:
        return None
    e, f = distances[_BEFORE], distances
    return np.asarray(np.stack([e * d - b * f, a * f - e * c], axis=1) / determinant[:, None])
