"""Where an object of the catalogue's shapes meets a pad: indentation, covered range, tilt."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from lsds_mocks.gel.placement import Placement

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lsds_mocks.fingertip.pose import Pose
    from lsds_mocks.objects.catalogue import ShapeName

_UPRIGHT = math.cos(math.radians(45))
"""Cosine between the object's and the pad's y above which the object's ends lie across the pad's y."""


class Touch(NamedTuple):
    """Indentation at the pad's centre (m, negative before touch), range of the pad's y that the object covers (m; None
    for all), tilt of the surface against the pad (rad), and position of the object's origin on the pad."""

    indentation_m: float
    reach_m: tuple[float, float] | None
    tilt_rad: float
    place: Placement


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
        ends = (self.half_m, self.half_m) if self.shape == "sphere" else (self.above_m, self.below_m)
        cosine = 1.0 if self.shape == "sphere" else float(along[1])
        lies, reach = _reach(float(p[1]), cosine, ends, pad_m[1] / 2)
        if not lies:
            return None
        if self.shape == "sphere":
            over = abs(p[0]) < self.half_m + pad_m[0] / 2
            return Touch(self.half_m - float(p[2]), reach, 0.0, place) if over else None
        if not self._is_over(p, along, pad_m):
            return None
        if self.shape == "cylinder":
            return Touch(self.half_m - _height_over_centre(p, along), reach, abs(math.asin(_unit(along[2]))), place)
        outward = seen.rotation[:, 2]
        outward = -outward if outward[2] > 0 else outward
        tilt = math.acos(_unit(-outward[2]))
        face = p + self.half_m * outward
        if self.shape == "edge":
            return Touch(-_height_over_centre(face, along), reach, tilt, place)
        # Within a right angle of the pad the face has a height over its centre; a face on edge does not.
        height = float(outward @ face) / min(float(outward[2]), -1e-6)
        return Touch(-height, reach, tilt, place)

    def _is_over(self, p: NDArray[np.float64], along: NDArray[np.float64], pad_m: tuple[float, float]) -> bool:
        """Return whether an object, as wide as it is along its whole length, lies over the pad."""
        length = math.hypot(along[0], along[1])
        if length < 1e-3:
            return True
        x, y = float(along[1] / length), float(-along[0] / length)
        pad = 0.5 * (pad_m[0] * abs(x) + pad_m[1] * abs(y))
        return abs(float(p[0]) * x + float(p[1]) * y) < self.half_width_m + pad


def _reach(
    y_m: float, cosine: float, ends_m: tuple[float, float], half_m: float
) -> tuple[bool, tuple[float, float] | None]:
    """Return whether the object lies over the pad along y, and the range that it covers; None for all of it."""
    above, below = ends_m
    if abs(cosine) < _UPRIGHT:
        return abs(y_m) < half_m + max(ends_m), None
    low, high = (y_m - above, y_m + below) if cosine > 0 else (y_m - below, y_m + above)
    if low <= -half_m and high >= half_m:
        return True, None
    low, high = max(low, -half_m), min(high, half_m)
    return low < high, (low, high)


def _height_over_centre(point: NDArray[np.float64], along: NDArray[np.float64]) -> float:
    """Return the height of a line through `point` where it passes nearest to the pad's centre."""
    flat = float(along[0] ** 2 + along[1] ** 2)
    if flat < 1e-6:
        return float(point[2])
    return float(point[2] - along[2] * (point[0] * along[0] + point[1] * along[1]) / flat)


def _unit(value: float) -> float:
    return min(max(float(value), -1.0), 1.0)
