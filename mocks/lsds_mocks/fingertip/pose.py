"""Poses of pad and object, and the motion of the object in the pad's frame."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lsds.errors import DataError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

_ROTATION_ERROR = 1e-3
"""Greatest deviation of R^T R from the identity that still counts as a rotation."""
_NO_ROTATION = "the matrix is not a rotation; pass columns of orthogonal, right-handed unit axes"


class Pose(NamedTuple):
    """Position (3,) in metres and rotation matrix (3, 3) of a frame; the matrix's columns are the frame's axes."""

    position_m: NDArray[np.float64]
    rotation: NDArray[np.float64]

    @classmethod
    def of(cls, position_m: ArrayLike, rotation: ArrayLike | None = None, *, name: str = "pose") -> Pose:
        """Return a checked pose; `rotation` has 3 x 3 or 9 values, None is the identity.

        Raises DataError, which names the pose, for values that are not finite or do not form a rotation.
        """
        try:
            place = np.array(position_m, np.float64).ravel()
            turn = np.eye(3) if rotation is None else np.array(rotation, np.float64).ravel()
        except (TypeError, ValueError) as error:
            raise DataError(f"{name}: position or rotation is not made of numbers: {error}") from error
        if place.size != 3 or turn.size != 9:
            raise DataError(f"{name}: position has {place.size} values and rotation {turn.size}; pass 3 and 9")
        turn = turn.reshape(3, 3)
        pose = cls(place, turn).checked(name)
        if np.abs(turn.T @ turn - np.eye(3)).max() > _ROTATION_ERROR or np.linalg.det(turn) < 0:
            raise DataError(f"{name}: {_NO_ROTATION}")
        return pose

    def checked(self, name: str) -> Pose:
        """Return this pose; raise DataError, which names it, for other shapes, for a value that is not finite, and for
        axes that are too long or too short."""
        if not (isinstance(self.position_m, np.ndarray) and isinstance(self.rotation, np.ndarray)):
            raise DataError(f"{name}: position and rotation are no arrays; make it with Pose.of(position, rotation)")
        if self.position_m.dtype.kind not in "fiu" or self.rotation.dtype.kind not in "fiu":
            raise DataError(f"{name}: position or rotation is not made of numbers")
        if self.position_m.shape != (3,) or self.rotation.shape != (3, 3):
            raise DataError(
                f"{name}: position has the shape {self.position_m.shape} and rotation {self.rotation.shape}; pass (3,) "
                "and (3, 3)"
            )
        if not math.isfinite(self.position_m.sum() + self.rotation.sum()):
            raise DataError(f"{name}: a value is not finite; check whether the scene's simulation diverged")
        # A pose is checked in each step: the squares of three unit axes cost a tenth of the full test.
        if abs(float(np.vdot(self.rotation, self.rotation)) - 3) > 3 * _ROTATION_ERROR:
            raise DataError(f"{name}: {_NO_ROTATION}")
        return self

    def seen_from(self, base: Pose) -> Pose:
        """Return this pose in the frame `base`."""
        back = base.rotation.T
        return Pose(back @ (self.position_m - base.position_m), back @ self.rotation)


def moment_of(arm_m: NDArray[np.float64], force_n: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the moment (3,) of a force on an arm. For one pair of vectors it is ten times as fast as `np.cross`."""
    x, y, z = arm_m.tolist()
    fx, fy, fz = force_n.tolist()
    return np.array([y * fz - z * fy, z * fx - x * fz, x * fy - y * fx])


class Motion(NamedTuple):
    """Rigid motion of an object at the pad's centre: along x and y (m), and about the normal from x to y (rad)."""

    dx_m: float
    dy_m: float
    dtheta_rad: float


NO_MOTION = Motion(0.0, 0.0, 0.0)


def motion_between(before: Pose, after: Pose) -> Motion:
    """Return the motion of the object's material point at the pad's centre between two poses in the pad's frame.

    Rotation about the object's own axis therefore moves the contact, as a rolling cylinder does.
    """
    turn = after.rotation @ before.rotation.T
    moved = after.position_m - turn @ before.position_m
    return Motion(float(moved[0]), float(moved[1]), math.atan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1]))
