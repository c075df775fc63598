"""The camera that views the cell: its projection and its pose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lsds.calibration.vision.camera import CameraModel
from lsds_mocks.byte_cache import kept

if TYPE_CHECKING:
    from numpy.typing import NDArray

DISTORTION = (-0.06, 0.04, 0.0006, -0.0004, 0.0)
"""Distortion (k1 k2 p1 p2 k3): a mild barrel, typical of small cameras."""
_FOCAL_PER_WIDTH = {(640, 480): 615.0 / 640, (1280, 720): 912.0 / 1280}
"""Focal length over width of a D435i's colour camera at its two usual sizes."""
_UNDISTORTION_ITERATIONS = 40
"""Number of fixed-point iterations that remove the distortion; chosen."""


def camera_model(width: int, height: int, distortion: tuple[float, ...] = DISTORTION) -> CameraModel:
    """Return the intrinsics at a size; the principal point is slightly off the centre, as in real cameras."""
    focal = _FOCAL_PER_WIDTH.get((width, height), 0.96) * width
    matrix = np.array([[focal, 0, 0.506 * width], [0, focal, 0.493 * height], [0, 0, 1.0]])
    return CameraModel(matrix, np.array(distortion), (width, height))


@dataclass(frozen=True, slots=True, eq=False)
class Viewpoint:
    """Pose of a camera, base <- camera: rotation (3, 3) and position (3,) in metres."""

    rotation: NDArray[np.float64]
    position_m: NDArray[np.float64]

    @staticmethod
    def looking(position_m: tuple[float, float, float], at_m: tuple[float, float, float]) -> Viewpoint:
        """Return the viewpoint at one point, directed at another, with a level horizon."""
        eye, target = np.array(position_m), np.array(at_m)
        forward = (target - eye) / np.linalg.norm(target - eye)
        right = np.cross(forward, (0.0, 0.0, 1.0))
        right /= np.linalg.norm(right)
        return Viewpoint(np.stack([right, np.cross(forward, right), forward], axis=1), eye)

    def seen(
        self, rotation: NDArray[np.float64], position_m: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return camera <- body for a body given as base <- body."""
        return self.rotation.T @ rotation, self.rotation.T @ (position_m - self.position_m)


class Rays:
    """Directions of the pixels' rays: x/z and y/z (height, width) at pixel centres."""

    def __init__(self, camera: CameraModel) -> None:
        (fx, _, cx), (_, fy, cy), _ = camera.matrix.tolist()
        self.x, self.y = _directions(camera.size, (fx, fy, cx, cy), tuple(camera.distortion.tolist()))


@kept
def _directions(
    size: tuple[int, int], lens: tuple[float, ...], distortion: tuple[float, ...]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return x/z and y/z (height, width), the same arrays for the same camera; do not modify them."""
    (width, height), (fx, fy, cx, cy) = size, lens
    u, v = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
    x, y = undistorted((u - cx) / fx, (v - cy) / fy, np.array(distortion))
    x.flags.writeable = y.flags.writeable = False
    return x, y


def undistorted(
    x: NDArray[np.float64], y: NDArray[np.float64], distortion: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the undistorted directions of distorted ones (x, y), for coefficients k1 k2 p1 p2 k3.

    It iterates until the result is constant, because the accuracy of every picture depends on this map.
    """
    k1, k2, p1, p2, k3 = distortion.tolist()
    xu, yu = x.copy(), y.copy()
    for _ in range(_UNDISTORTION_ITERATIONS):
        r2 = xu * xu + yu * yu
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        dx = 2 * p1 * xu * yu + p2 * (r2 + 2 * xu * xu)
        dy = p1 * (r2 + 2 * yu * yu) + 2 * p2 * xu * yu
        xu, yu = (x - dx) / radial, (y - dy) / radial
    return xu, yu
