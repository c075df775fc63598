"""Rotation matrices, unit quaternions (x, y, z, w) and rigid transforms between frames."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from lsds.contracts.values import Pose, Quaternion

if TYPE_CHECKING:
    from numpy.typing import NDArray


def quaternion_of(rotation: NDArray[np.float64]) -> Quaternion:
    """Return the unit quaternion (w >= 0) of a rotation matrix (3, 3), by the largest of four equivalent ways."""
    m = rotation
    squares = np.array([m[0, 0], m[1, 1], m[2, 2], np.trace(m)])
    largest = int(np.argmax(squares))
    if largest == 3:
        q = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], 1 + squares[3]])
    else:
        i, j, k = largest, (largest + 1) % 3, (largest + 2) % 3
        q = np.zeros(4)
        q[i] = 1 + m[i, i] - m[j, j] - m[k, k]
        q[j], q[k] = m[j, i] + m[i, j], m[k, i] + m[i, k]
        q[3] = m[k, j] - m[j, k]
    q *= (1.0 if q[3] >= 0 else -1.0) / np.linalg.norm(q)
    x, y, z, w = (float(part) for part in q)
    return x, y, z, w


def rotation_of(quaternion: Quaternion) -> NDArray[np.float64]:
    """Return the rotation matrix (3, 3) of a quaternion, which is normalised first."""
    x, y, z, w = np.asarray(quaternion) / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def pose_of(rotation: NDArray[np.float64], position_m: NDArray[np.float64]) -> Pose:
    """Return the pose with this rotation (3, 3) and position (3,)."""
    x, y, z = (float(part) for part in np.asarray(position_m).reshape(3))
    return Pose((x, y, z), quaternion_of(rotation))


def angle_between(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Return the angle (rad) of the rotation that leads from one rotation matrix to another."""
    return math.acos(min(1.0, max(-1.0, (float(np.trace(one.T @ other)) - 1) / 2)))
