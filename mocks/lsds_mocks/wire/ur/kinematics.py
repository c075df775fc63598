"""Kinematics of the e-Series: forward, Jacobian, and all inverse solutions in closed form.

Denavit-Hartenberg parameters as published by Universal Robots ("DH Parameters for calculations of kinematics and
dynamics"): nominal values without an arm's calibration. The closed form relies on properties of all sizes: the second,
third and fourth axes are parallel, and neighbouring wrist axes are perpendicular.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lsds_mocks.wire.ur.pose_math import Rotation, Vec, compose, rotation_of, vector_of

JOINTS = 6
"""Number of joints."""
JOINT_LIMIT_RAD = 2 * math.pi
"""Range of a joint to either side, rad: one turn (UR5e data sheet)."""


@dataclass(frozen=True, slots=True)
class ArmModel:
    """One size of arm: link lengths a2, a3 and offsets d1, d4, d5, d6 in metres, its type number on the wire, payload
    (kg), reach (m) and joint speed limits (rad/s)."""

    name: str
    type_number: int
    a2: float
    a3: float
    d1: float
    d4: float
    d5: float
    d6: float
    payload_kg: float
    reach_m: float
    joint_speed_rad_s: tuple[float, ...] = (math.pi,) * JOINTS


_SLOW_SHOULDER = (math.radians(120), math.radians(120), math.pi, math.pi, math.pi, math.pi)
"""Speed limits of the joints of UR10e and UR16e, rad/s: base and shoulder are slower than the other joints."""
MODELS = {
    model.name: model
    for model in (
        ArmModel(
            "ur3e",
            3,
            -0.24355,
            -0.2132,
            0.15185,
            0.13105,
            0.08535,
            0.0921,
            3,
            0.5,
            (math.pi, math.pi, math.pi, 2 * math.pi, 2 * math.pi, 2 * math.pi),
        ),
        ArmModel("ur5e", 1, -0.425, -0.3922, 0.1625, 0.1333, 0.0997, 0.0996, 5, 0.85),
        ArmModel("ur10e", 2, -0.6127, -0.57155, 0.1807, 0.17415, 0.11985, 0.11655, 12.5, 1.3, _SLOW_SHOULDER),
        ArmModel("ur16e", 4, -0.4784, -0.36, 0.1807, 0.17415, 0.11985, 0.11655, 16, 0.9, _SLOW_SHOULDER),
    )
}
"""By name."""


@dataclass(frozen=True, slots=True)
class Frames:
    """Directions of the joints' axes, points on them, and the flange."""

    axes: tuple[Vec, ...]
    points: tuple[Vec, ...]
    flange_m: Vec
    flange: Rotation


class Kinematics:
    """Kinematics of one arm. Joint angles in radians, poses in the base frame."""

    def __init__(self, model: ArmModel) -> None:
        self.model = model

    def frames(self, q: Sequence[float]) -> Frames:
        """Return axes, points and flange of a configuration."""
        m = self.model
        c1, s1, c2, s2 = math.cos(q[0]), math.sin(q[0]), math.cos(q[1]), math.sin(q[1])
        c23, s23 = math.cos(q[1] + q[2]), math.sin(q[1] + q[2])
        bend = q[1] + q[2] + q[3]
        cb, sb, c5, s5, c6, s6 = (*_cs(bend), *_cs(q[4]), *_cs(q[5]))
        side = (s1, -c1, 0.0)
        elbow = (m.a2 * c2 * c1, m.a2 * c2 * s1, m.d1 + m.a2 * s2)
        reach = m.a2 * c2 + m.a3 * c23
        wrist1 = (reach * c1, reach * s1, m.d1 + m.a2 * s2 + m.a3 * s23)
        wrist2 = (wrist1[0] + m.d4 * s1, wrist1[1] - m.d4 * c1, wrist1[2])
        z4 = (c1 * sb, s1 * sb, -cb)
        x4 = (c1 * cb, s1 * cb, sb)
        wrist3 = (wrist2[0] + m.d5 * z4[0], wrist2[1] + m.d5 * z4[1], wrist2[2] + m.d5 * z4[2])
        z5 = (-s5 * x4[0] + c5 * s1, -s5 * x4[1] - c5 * c1, -s5 * x4[2])
        x5 = (c5 * x4[0] + s5 * s1, c5 * x4[1] - s5 * c1, c5 * x4[2])
        x6 = (c6 * x5[0] - s6 * z4[0], c6 * x5[1] - s6 * z4[1], c6 * x5[2] - s6 * z4[2])
        y6 = (-s6 * x5[0] - c6 * z4[0], -s6 * x5[1] - c6 * z4[1], -s6 * x5[2] - c6 * z4[2])
        flange_m = (wrist3[0] + m.d6 * z5[0], wrist3[1] + m.d6 * z5[1], wrist3[2] + m.d6 * z5[2])
        flange: Rotation = ((x6[0], y6[0], z5[0]), (x6[1], y6[1], z5[1]), (x6[2], y6[2], z5[2]))
        shoulder = (0.0, 0.0, m.d1)
        return Frames(
            ((0.0, 0.0, 1.0), side, side, side, z4, z5),
            ((0.0, 0.0, 0.0), shoulder, elbow, wrist1, wrist2, wrist3),
            flange_m,
            flange,
        )

    def flange(self, q: Sequence[float]) -> list[float]:
        """Return the pose of the tool flange."""
        frames = self.frames(q)
        return [*frames.flange_m, *vector_of(frames.flange)]

    def tcp(self, q: Sequence[float], offset: Sequence[float]) -> list[float]:
        """Return the pose of a tool centre point at `offset` from the flange."""
        return compose(self.flange(q), offset) if any(offset) else self.flange(q)

    def jacobian(self, q: Sequence[float], point_m: Sequence[float]) -> NDArray[np.float64]:
        """Return (6, 6) from joint speeds to the velocity of a point (m/s) and the angular velocity, base frame."""
        frames = self.frames(q)
        columns = []
        for (ax, ay, az), (px, py, pz) in zip(frames.axes, frames.points, strict=True):
            x, y, z = point_m[0] - px, point_m[1] - py, point_m[2] - pz
            columns.append((ay * z - az * y, az * x - ax * z, ax * y - ay * x, ax, ay, az))
        return np.array(columns).T

    def inverse(self, flange_pose: Sequence[float], near: Sequence[float]) -> list[float] | None:
        """Return the solution for a flange pose that is nearest to `near`; None if the pose is out of reach."""
        best: tuple[float, list[float]] | None = None
        for q in self.solutions(flange_pose, near):
            distance = sum((a - b) ** 2 for a, b in zip(q, near, strict=True))
            if best is None or distance < best[0]:
                best = (distance, q)
        return None if best is None else best[1]

    def solutions(self, flange_pose: Sequence[float], near: Sequence[float]) -> list[list[float]]:
        """Return all solutions within the joint limits, each angle shifted by whole turns to be nearest to `near`."""
        m, rotation = self.model, rotation_of(flange_pose[3:])
        (xx, yx, zx), (xy, yy, zy), (xz, yz, zz) = rotation
        px, py, pz = flange_pose[:3]
        wx, wy, wz = px - m.d6 * zx, py - m.d6 * zy, pz - m.d6 * zz
        radius = math.hypot(wx, wy)
        if radius < abs(m.d4):
            return []
        found = []
        lean, heading = math.acos(m.d4 / radius), math.atan2(wy, wx) + math.pi / 2
        for q1 in (heading + lean, heading - lean):
            c1, s1 = math.cos(q1), math.sin(q1)
            cosine = (px * s1 - py * c1 - m.d4) / m.d6
            if abs(cosine) > 1 + 1e-9:
                continue
            for q5 in _both(math.acos(min(max(cosine, -1.0), 1.0))):
                s5 = math.sin(q5)
                # With a straight wrist, the last angle is free.
                free = abs(s5) < 1e-7
                q6 = near[5] if free else math.atan2(-(yx * s1 - yy * c1) / s5, (xx * s1 - xy * c1) / s5)
                c6, s6 = math.cos(q6), math.sin(q6)
                ax, ay, az = s6 * xx + c6 * yx, s6 * xy + c6 * yy, s6 * xz + c6 * yz
                bend = math.atan2(-(c1 * ax + s1 * ay), az)
                # From the third wrist joint back along the two wrist offsets to the end of the forearm.
                fx, fy, fz = wx + m.d5 * ax - m.d4 * s1, wy + m.d5 * ay + m.d4 * c1, wz + m.d5 * az - m.d1
                out = c1 * fx + s1 * fy
                c3 = (out * out + fz * fz - m.a2**2 - m.a3**2) / (2 * m.a2 * m.a3)
                if abs(c3) > 1 + 1e-9:
                    continue
                for q3 in _both(math.acos(min(max(c3, -1.0), 1.0))):
                    q2 = math.atan2(fz, out) - math.atan2(m.a3 * math.sin(q3), m.a2 + m.a3 * math.cos(q3))
                    q = [_near(a, b) for a, b in zip((q1, q2, q3, bend - q2 - q3, q5, q6), near, strict=True)]
                    found.append(q)
        return found


def _cs(angle: float) -> tuple[float, float]:
    return math.cos(angle), math.sin(angle)


def _both(angle: float) -> tuple[float, float]:
    return angle, -angle


def _near(angle: float, to: float) -> float:
    """Return the angle, shifted by whole turns to be nearest to another, within the joint's limits."""
    angle += 2 * math.pi * round((to - angle) / (2 * math.pi))
    if angle > JOINT_LIMIT_RAD:
        return angle - 2 * math.pi
    return angle + 2 * math.pi if angle < -JOINT_LIMIT_RAD else angle
