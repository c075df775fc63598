"""Where an object of the catalogue's shapes meets a pad: indentation, covered range, tilt."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lsds_mocks.gel.placement import Placement

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.fingertip.pose import Pose
    from lsds_mocks.objects.catalogue import ShapeName

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
        p, along = seen.position_m, seen.rotation[:, 1]
        place = Placement(float(p[0]), float(p[1]), math.atan2(-along[0], along[1]))
        half_pad = pad_m[0] / 2, pad_m[1] / 2
        if self.shape == "sphere":
            return self._ball(float(p[2]), place, half_pad)
        length = math.hypot(along[0], along[1])
        # Unit vector on the pad at right angles to the object.
        beside = np.array([along[1], -along[0], 0.0]) / length if length > _ON_END else np.array([1.0, 0.0, 0.0])
        outward = np.cross(beside, along) if self.shape == "cylinder" else seen.rotation[:, 2]
        outward = -outward if outward[2] > 0 else outward
        # The middle of the face, or of the line, that is turned to the pad.
        middle, before, after = p + self.half_m * outward, -self.above_m * along, self.below_m * along
        rolls = (0.0, 0.0)
        if self.shape == "box":
            side = self.half_width_m * seen.rotation[:, 0]
            height = _height_of_face(middle, side, before, after)
        else:
            side, height = self.half_m * beside, float(_nearest(middle, before, after)[2])
        if self.shape == "cylinder":
            side, rolls = self._cap_m(self.half_m + height) * beside, (float(beside[0]), float(beside[1]))
        reach = None
        if abs(along[1]) >= _UPRIGHT:
            ends = sorted((float(middle[1] + before[1]), float(middle[1] + after[1])))
            reach = _covered((ends[0], ends[1]), half_pad[1])
        if not _overlaps(middle, side, (before, after), half_pad) or (reach is not None and reach[0] >= reach[1]):
            return None
        return Touch(-height, reach, math.acos(_unit(-outward[2])), place, rolls)

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


def _overlaps(
    centre: NDArray[np.float64],
    side: NDArray[np.float64],
    ends: tuple[NDArray[np.float64], NDArray[np.float64]],
    half_pad: tuple[float, float],
) -> bool:
    """Return whether a parallelogram, seen along the pad's z, overlaps the pad: no line separates the two.

    `side` is the vector from its middle line to one side, `ends` are those from its centre to its ends.
    """
    corners = np.array([centre + end + sign * side for end in ends for sign in (-1.0, 1.0)])[:, :2]
    long = (ends[1] - ends[0])[:2]
    for x, y in ((1.0, 0.0), (0.0, 1.0), (-side[1], side[0]), (-long[1], long[0])):
        size = math.hypot(x, y)
        if size < 1e-12:
            continue
        at = corners @ np.array([x, y])
        pad = half_pad[0] * abs(x) + half_pad[1] * abs(y)
        if at.min() >= pad or at.max() <= -pad:
            return False
    return True


def _nearest(
    middle: NDArray[np.float64], before: NDArray[np.float64], after: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the point (3,) of a line, from `middle` + `before` to `middle` + `after`, that is nearest to the pad's
    centre, seen along the pad's z; `middle` itself of a line that stands on its end."""
    start, along = middle + before, after - before
    flat = float(along[0] ** 2 + along[1] ** 2)
    if flat < _ON_END**2 * float(along @ along):
        return middle
    part = min(max(-float(start[:2] @ along[:2]) / flat, 0.0), 1.0)
    return np.asarray(start + part * along)


def _height_of_face(
    centre: NDArray[np.float64], side: NDArray[np.float64], before: NDArray[np.float64], after: NDArray[np.float64]
) -> float:
    """Return the height of a face where it is nearest to the pad's centre, seen along the pad's z; for the vectors see
    `_overlaps`."""
    start, long, wide = centre + before - side, after - before, 2 * side
    area = float(wide[0] * long[1] - wide[1] * long[0])
    if abs(area) > _ON_END * math.sqrt(float(wide @ wide) * float(long @ long)):
        u = float(-start[0] * long[1] + start[1] * long[0]) / area
        v = float(-wide[0] * start[1] + wide[1] * start[0]) / area
        if 0 <= u <= 1 and 0 <= v <= 1:
            return float(start[2] + u * wide[2] + v * long[2])
    # The pad's centre is not under the face: one of its four sides is nearest.
    none = np.zeros(3)
    sides = ((start, long), (start + wide, long), (start, wide), (start + long, wide))
    points = (_nearest(at, none, to) for at, to in sides)
    return float(min(points, key=lambda point: math.hypot(point[0], point[1]))[2])


def _unit(value: float) -> float:
    return min(max(float(value), -1.0), 1.0)
