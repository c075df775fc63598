"""Position and rotation of an object on the pad."""

from __future__ import annotations

import math
from typing import NamedTuple


class Placement(NamedTuple):
    """Position of the object's origin on the pad (m), and its rotation from x to y (rad)."""

    x_m: float = 0.0
    y_m: float = 0.0
    angle_rad: float = 0.0

    def moved(self, dx_m: float, dy_m: float, dtheta_rad: float) -> Placement:
        """Return the placement after a rigid motion about the pad's centre."""
        if dtheta_rad == 0.0:
            return Placement(self.x_m + dx_m, self.y_m + dy_m, self.angle_rad)
        cos, sin = math.cos(dtheta_rad), math.sin(dtheta_rad)
        x, y = cos * self.x_m - sin * self.y_m, sin * self.x_m + cos * self.y_m
        return Placement(x + dx_m, y + dy_m, self.angle_rad + dtheta_rad)

    def distance_m(self, other: Placement) -> float:
        """Return the distance (m) between two placements, with rotation counted at the rim of a pad."""
        return math.hypot(self.x_m - other.x_m, self.y_m - other.y_m) + _RIM_M * abs(self.angle_rad - other.angle_rad)


_RIM_M = 10e-3
"""Radius at which a rotation is counted as a distance, m: about that of a pad's rim."""
ORIGIN = Placement()
