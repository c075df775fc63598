"""Where an object of the catalogue's shapes meets a pad: indentation, covered range, tilt."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from lsds_mocks.gel.placement import Placement

if TYPE_CHECKING:
    from lsds_mocks.fingertip.pose import Pose
    from lsds_mocks.objects.catalogue import ShapeName

_Vector: TypeAlias = tuple[float, float, float]
"""A vector in the pad's frame, m. With three numbers, plain floats are many times as fast as arrays."""
_UPRIGHT = math.cos(math.radians(45))
"""Cosine between the object's and the pad's y above which the object's ends lie across the pad's y."""
_ON_END = 1e-3
"""Length on the pad of a unit vector along the object below which the object stands on its end."""


class Touch(NamedTuple):
    """Indentation where the object comes nearest to the pad's centre (m, negative before touch), range of the pad's y
    that the object covers (m; None for all), tilt of the surface against the pad (rad), position of the object's origin
    on the pad, and direction in which it rolls: a unit vector on the pad, None for a sphere, (0, 0) for a face."""

    indentation_m: float
    reach_m: tuple[float, float] | None
    tilt_rad: float
    place: Placement
    rolls: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class Outline:
    """Outer form of an object: shape, half thickness between the pads, ends along its y before and after its origin
    (m, both positive), and half width along its x."""

    shape: ShapeName
    half_m: float
    above_m: float
    below_m: float
    half_width_m: float

    def touch(self, seen: Pose, pad_m: tuple[float, float]) -> Touch | None:
        """Return how an object at pose `seen` in the pad's frame meets a pad of width and height `pad_m`; None if it
        does not lie over the pad."""
        across, along, through = (_vector(axis) for axis in seen.rotation.T.tolist())
        p = _vector(seen.position_m.tolist())
        place = Placement(p[0], p[1], math.atan2(-along[0], along[1]))
        half_pad = pad_m[0] / 2, pad_m[1] / 2
        if self.shape == "sphere":
            return self._ball(p[2], place, half_pad)
        length = math.hypot(along[0], along[1])
        # Unit vector on the pad at right angles to the object.
        beside = (along[1] / length, -along[0] / length, 0.0) if length > _ON_END else (1.0, 0.0, 0.0)
        outward = _cross(beside, along) if self.shape == "cylinder" else through
        outward = _times(-1.0, outward) if outward[2] > 0 else outward
        # The middle of the face, or of the line, that is turned to the pad.
        middle, before, after = (
            _plus(p, self.half_m, outward),
            _times(-self.above_m, along),
            _times(self.below_m, along),
        )
        rolls = (0.0, 0.0)
        if self.shape == "box":
            side = _times(self.half_width_m, across)
            height = _height_of_face(middle, side, before, after)
        else:
            side, height = _times(self.half_m, beside), _nearest(middle, before, after)[2]
        if self.shape == "cylinder":
            side, rolls = _times(self._cap_m(self.half_m + height), beside), beside[:2]
        reach = None
        if abs(along[1]) >= _UPRIGHT:
            start, end = middle[1] + before[1], middle[1] + after[1]
            reach = _covered((min(start, end), max(start, end)), half_pad[1])
        if (reach is not None and reach[0] >= reach[1]) or not _overlaps(middle, side, (before, after), half_pad):
            return None
        return Touch(-height, reach, math.acos(_unit(-outward[2])), place, rolls)

    def offset_m(self, place: Placement, pad_width_m: float) -> float:
        """Return how far a contact lies off the pad's centre (m) in directions that change it: not along an object, nor
        across a face that covers the pad's width."""
        if self.shape == "sphere":
            return math.hypot(place.x_m, place.y_m)
        offset = abs(place.x_m * math.cos(place.angle_rad) + place.y_m * math.sin(place.angle_rad))
        covers = self.shape == "box" and self.half_width_m - offset >= pad_width_m / 2
        return 0.0 if covers else offset

    def yaw_rad(self, place: Placement) -> float:
        """Return the turn of an object's outline about the pad's normal (rad), from 0 to pi/2; 0 for a sphere."""
        return 0.0 if self.shape == "sphere" else abs(math.remainder(place.angle_rad, math.pi))

    def _ball(self, height_m: float, place: Placement, half_pad: tuple[float, float]) -> Touch | None:
        cap_m = self._cap_m(height_m)
        if not (abs(place.x_m) < half_pad[0] + cap_m and abs(place.y_m) < half_pad[1] + cap_m):
            return None
        reach = _covered((place.y_m - self.half_m, place.y_m + self.half_m), half_pad[1])
        return Touch(self.half_m - height_m, reach, 0.0, place, None)

    def _cap_m(self, height_m: float) -> float:
        """Return half the width of the part below the gel's surface, of a round object whose middle is at a height."""
        return math.sqrt(max(self.half_m**2 - min(height_m, self.half_m) ** 2, 0.0))


def _covered(range_m: tuple[float, float], half_m: float) -> tuple[float, float] | None:
    """Return the part of a range of y that lies on the pad; None for all of the pad."""
    low, high = range_m
    return None if low <= -half_m and high >= half_m else (max(low, -half_m), min(high, half_m))


def _overlaps(centre: _Vector, side: _Vector, ends: tuple[_Vector, _Vector], half_pad: tuple[float, float]) -> bool:
    """Return whether a parallelogram, seen along the pad's z, overlaps the pad: no line separates the two.

    `side` is the vector from its middle line to one side, `ends` are those from its centre to its ends.
    """
    start, end = ((centre[0] + to[0], centre[1] + to[1]) for to in ends)
    long = end[0] - start[0], end[1] - start[1]
    for x, y in ((1.0, 0.0), (0.0, 1.0), (-side[1], side[0]), (-long[1], long[0])):
        if math.hypot(x, y) < 1e-12:
            continue
        pad = half_pad[0] * abs(x) + half_pad[1] * abs(y)
        first, last, width = start[0] * x + start[1] * y, end[0] * x + end[1] * y, abs(side[0] * x + side[1] * y)
        if min(first, last) - width >= pad or max(first, last) + width <= -pad:
            return False
    return True


def _nearest(middle: _Vector, before: _Vector, after: _Vector) -> _Vector:
    """Return the point of a line, from `middle` + `before` to `middle` + `after`, that is nearest to the pad's centre,
    seen along the pad's z; `middle` itself of a line that stands on its end."""
    start, along = _plus(middle, 1.0, before), _plus(after, -1.0, before)
    flat = along[0] ** 2 + along[1] ** 2
    if flat < _ON_END**2 * _dot(along, along):
        return middle
    part = min(max(-(start[0] * along[0] + start[1] * along[1]) / flat, 0.0), 1.0)
    return _plus(start, part, along)


def _height_of_face(centre: _Vector, side: _Vector, before: _Vector, after: _Vector) -> float:
    """Return the height of a face where it is nearest to the pad's centre, seen along the pad's z; for the vectors see
    `_overlaps`."""
    start, long, wide = _plus(_plus(centre, 1.0, before), -1.0, side), _plus(after, -1.0, before), _times(2.0, side)
    area = wide[0] * long[1] - wide[1] * long[0]
    if abs(area) > _ON_END * math.sqrt(_dot(wide, wide) * _dot(long, long)):
        u = (-start[0] * long[1] + start[1] * long[0]) / area
        v = (-wide[0] * start[1] + wide[1] * start[0]) / area
        if 0 <= u <= 1 and 0 <= v <= 1:
            return start[2] + u * wide[2] + v * long[2]
    # The pad's centre is not under the face: one of its four sides is nearest.
    sides = ((start, long), (_plus(start, 1.0, wide), long), (start, wide), (_plus(start, 1.0, long), wide))
    points = (_nearest(at, (0.0, 0.0, 0.0), to) for at, to in sides)
    return min(points, key=lambda point: math.hypot(point[0], point[1]))[2]


def _vector(values: list[float]) -> _Vector:
    x, y, z = values
    return x, y, z


def _plus(a: _Vector, times: float, b: _Vector) -> _Vector:
    return a[0] + times * b[0], a[1] + times * b[1], a[2] + times * b[2]


def _times(factor: float, a: _Vector) -> _Vector:
    return factor * a[0], factor * a[1], factor * a[2]


def _dot(a: _Vector, b: _Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: _Vector, b: _Vector) -> _Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _unit(value: float) -> float:
    return min(max(value, -1.0), 1.0)
