"""Poses in the controller's form: x, y, z in metres and a rotation vector in radians.

They are plain floats, because creating arrays of six would take too long for a control cycle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

Vec = tuple[float, float, float]
Rotation = tuple[Vec, Vec, Vec]
"""Rows of a rotation matrix."""

_SMALL = 1e-12
"""Angle, or its sine, below which the limits of the formulas for small rotations apply, rad; chosen."""


def rotation_of(vector: Sequence[float]) -> Rotation:
    """Return the matrix of a rotation vector (Rodrigues)."""
    x, y, z = vector
    angle = math.sqrt(x * x + y * y + z * z)
    if angle < _SMALL:
        return ((1.0, -z, y), (z, 1.0, -x), (-y, x, 1.0))
    x, y, z = x / angle, y / angle, z / angle
    c, s = math.cos(angle), math.sin(angle)
    v = 1.0 - c
    return (
        (x * x * v + c, x * y * v - z * s, x * z * v + y * s),
        (x * y * v + z * s, y * y * v + c, y * z * v - x * s),
        (x * z * v - y * s, y * z * v + x * s, z * z * v + c),
    )


def vector_of(rotation: Rotation) -> Vec:
    """Return the rotation vector of a matrix, of length at most pi."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = h - f, c - g, d - b
    sine, cosine = math.sqrt(x * x + y * y + z * z) / 2, (a + e + i - 1.0) / 2
    angle = math.atan2(sine, cosine)
    if sine > 1e-6 or cosine > 0:
        scale = angle / (2 * sine) if sine > _SMALL else 0.5
        return x * scale, y * scale, z * scale
    # At half a turn the symmetric part contains the axis, whose sign is arbitrary.
    axis = [math.sqrt(max(0.0, (entry + 1.0) / 2)) for entry in (a, e, i)]
    largest = axis.index(max(axis))
    for other, product in enumerate(((a, b, c), (d, e, f), (g, h, i))[largest]):
        if other != largest and product < 0:
            axis[other] = -axis[other]
    return axis[0] * angle, axis[1] * angle, axis[2] * angle


def multiply(left: Rotation, right: Rotation) -> Rotation:
    """Return left times right."""
    columns = tuple(zip(*right, strict=True))
    return tuple(tuple(r[0] * c[0] + r[1] * c[1] + r[2] * c[2] for c in columns) for r in left)  # type: ignore[return-value]


def transpose(rotation: Rotation) -> Rotation:
    """Return the inverse rotation."""
    return tuple(zip(*rotation, strict=True))  # type: ignore[return-value]


def turn(rotation: Rotation, vector: Sequence[float]) -> Vec:
    """Return the vector, rotated."""
    x, y, z = vector
    (a, b, c), (d, e, f), (g, h, i) = rotation
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def compose(first: Sequence[float], second: Sequence[float]) -> list[float]:
    """Return the pose `second`, given in the frame `first`, in the frame that `first` is given in."""
    rotation = rotation_of(first[3:])
    x, y, z = turn(rotation, second[:3])
    rx, ry, rz = vector_of(multiply(rotation, rotation_of(second[3:])))
    return [first[0] + x, first[1] + y, first[2] + z, rx, ry, rz]


def inverse(pose: Sequence[float]) -> list[float]:
    """Return the inverse pose."""
    back = transpose(rotation_of(pose[3:]))
    x, y, z = turn(back, pose[:3])
    return [-x, -y, -z, -pose[3], -pose[4], -pose[5]]


def difference(start: Sequence[float], end: Sequence[float]) -> tuple[Vec, Vec]:
    """Return translation and rotation vector from one pose to another, both in the base frame."""
    shift = (end[0] - start[0], end[1] - start[1], end[2] - start[2])
    return shift, vector_of(multiply(rotation_of(end[3:]), transpose(rotation_of(start[3:]))))


def between(start: Sequence[float], end: Sequence[float], share: float) -> list[float]:
    """Return the pose a share (0..1) of the way along a straight line, with the rotation at constant rate."""
    shift, rotation = difference(start, end)
    return moved(start, shift, rotation, share)


def moved(start: Sequence[float], shift: Sequence[float], rotation: Sequence[float], share: float) -> list[float]:
    """Return a pose moved by a share of a translation and a rotation vector, both in the base frame."""
    turned = multiply(rotation_of([share * r for r in rotation]), rotation_of(start[3:]))
    return [*(a + share * b for a, b in zip(start[:3], shift, strict=True)), *vector_of(turned)]


def norm(vector: Sequence[float]) -> float:
    """Return the Euclidean length."""
    return math.sqrt(sum(v * v for v in vector))
