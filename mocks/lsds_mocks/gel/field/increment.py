"""When a stretch of motion is long enough, or has turned enough, to be written into the gel's history.

Friction with memory is integrated over increments of motion, not of time: solutions inside an increment all start from
its beginning, so small steps do not add up small errors, and a frame rate has no say in the result. On straight
paths increments of 0.3 mm cost less than a micrometre; a turn must not be cut short, so an increment ends there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

LONG_M = 0.04e-3
"""An increment ends when the object has gone this far, or has been pressed in by so much."""
BACK_M = 1e-6
"""Or has come back by more than this from where it had been farthest."""
ARM_M = 2e-3
"""Distance at which turning counts as going."""
_TURN = math.cos(math.radians(30))


class Increment(NamedTuple):
    """Motion (m, rad) since an increment began, change of indentation (m), and the farthest it has been."""

    dx_m: float = 0.0
    dy_m: float = 0.0
    dtheta_rad: float = 0.0
    pressed_m: float = 0.0
    farthest_m: float = 0.0

    def and_then(self, dx_m: float, dy_m: float, dtheta_rad: float) -> Increment:
        """Return the increment with one more step."""
        x, y, turn = self.dx_m + dx_m, self.dy_m + dy_m, self.dtheta_rad + dtheta_rad
        length = math.sqrt(x * x + y * y + (ARM_M * turn) ** 2)
        return Increment(x, y, turn, self.pressed_m, max(self.farthest_m, length))

    @property
    def length_m(self) -> float:
        """How far it leads from its beginning."""
        return math.sqrt(self.dx_m**2 + self.dy_m**2 + (ARM_M * self.dtheta_rad) ** 2)

    def is_over(self, pressed_m: float) -> bool:
        """Tell whether it ends here, the indentation having changed by `pressed_m`."""
        length = self.length_m
        return length >= LONG_M or abs(pressed_m) >= LONG_M or self.farthest_m - length > BACK_M

    def turns_with(self, dx_m: float, dy_m: float, dtheta_rad: float) -> bool:
        """Tell whether a step would turn it by so much that it has to end first."""
        size = math.sqrt(dx_m * dx_m + dy_m * dy_m + (ARM_M * dtheta_rad) ** 2)
        length = self.length_m
        if size < BACK_M or length < BACK_M:
            return False
        along = dx_m * self.dx_m + dy_m * self.dy_m + ARM_M * ARM_M * dtheta_rad * self.dtheta_rad
        return along < _TURN * size * length

    def share_of(self, last: Increment) -> float:
        """Return which part of the last increment this one repeats, 0 to 1."""
        own = (self.dx_m, self.dy_m, ARM_M * self.dtheta_rad, self.pressed_m)
        other = (last.dx_m, last.dy_m, ARM_M * last.dtheta_rad, last.pressed_m)
        size = sum(o * o for o in other)
        along = sum(a * b for a, b in zip(own, other, strict=True))
        return min(max(along / size, 0.0), 1.0) if size > 0 else 0.0
