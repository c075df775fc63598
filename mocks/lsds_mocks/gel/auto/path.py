"""The motion history of a gel, in legs long enough to be retraced cheaply on another grid."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from lsds_mocks.gel.field.increment import TURN_ARM_M
from lsds_mocks.gel.placement import ORIGIN, Placement

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.grid import CellGrid

LEG_M = 0.2e-3
"""Longest leg: a straight leg of 0.3 mm taken at once causes an error below a micrometre."""
PRESS_M = 0.05e-3
"""Longest leg of pressing: a gel that is pressed all at once is up to 9 um off."""
MEMORY_M = 2e-3
"""Length of the path that is kept: friction depends no longer on motion farther back, since the surface has slid."""
MOST_LEGS = 100
"""Maximum number of legs."""
_LEG_REACH_M = 0.2e-3
"""A leg ends when an end of the object has moved this far over the pad: a part of a cell."""
_STRAIGHT = math.cos(math.radians(20))
"""Cosine of the largest angle between a leg and a step that continues it, 20 degrees; chosen."""
_WIGGLE_M = 2e-6
"""A leg ends when its steps off the course add up to this length; smaller trembles do not end it."""
_OTHER = 0.04
"""A leg ends when friction has changed by this part, because each leg is retraced with one friction."""


@dataclass(frozen=True, slots=True, eq=False)
class Friction:
    """Coefficients (N,) over cells (N,) of a grid, and their mean; 0 without cells."""

    grid: CellGrid
    cells: NDArray[np.int32]
    values: NDArray[np.float64]
    mean: float


class Leg(NamedTuple):
    """A straight leg: motion (m, rad), indentation (m) and reach at its end, and friction."""

    dx_m: float
    dy_m: float
    dtheta_rad: float
    indentation_m: float
    reach_m: tuple[float, float] | None
    friction: Friction | None

    @property
    def length_m(self) -> float:
        """Length (m), with rotation counted at the lever arm of increments."""
        return math.sqrt(self.dx_m**2 + self.dy_m**2 + (TURN_ARM_M * self.dtheta_rad) ** 2)

    def leads_on(self, dx_m: float, dy_m: float, dtheta_rad: float) -> bool:
        """Return whether a step continues in its direction."""
        own = self.length_m
        step = math.sqrt(dx_m**2 + dy_m**2 + (TURN_ARM_M * dtheta_rad) ** 2)
        along = self.dx_m * dx_m + self.dy_m * dy_m + TURN_ARM_M**2 * self.dtheta_rad * dtheta_rad
        return along >= _STRAIGHT * own * step


def _ends_apart(one: tuple[float, float] | None, other: tuple[float, float] | None) -> float:
    """Return the distance (m) between the ends of two ranges; None has its ends beyond the pad."""
    if one is None or other is None:
        return 0.0 if one == other else math.inf
    return max(abs(one[0] - other[0]), abs(one[1] - other[1]))


@dataclass(slots=True)
class Path:
    """Closed legs since `start`, of which the first `dropped` are forgotten, and the open leg.

    Legs from number `held` on are kept however old they are, because a follower is retracing them.
    """

    start: Placement = ORIGIN
    legs: list[Leg] = field(default_factory=list)
    dropped: int = 0
    open: Leg | None = None
    pressed_m: float = 0.0
    reach_m: tuple[float, float] | None = None
    kept_m: float = 0.0
    gone_m: float = 0.0
    off_course_m: float = 0.0
    first_friction: float = 0.0
    held: int = sys.maxsize

    @property
    def count(self) -> int:
        """Number of legs closed so far, including forgotten ones."""
        return self.dropped + len(self.legs)

    def add(
        self,
        step: tuple[float, float, float],
        indentation_m: float,
        reach_m: tuple[float, float] | None,
        friction: Friction | None,
    ) -> bool:
        """Append a step; return whether it turned a corner."""
        turned = False
        if self.open is not None and not self.open.leads_on(*step):
            self.off_course_m += math.sqrt(step[0] ** 2 + step[1] ** 2 + (TURN_ARM_M * step[2]) ** 2)
            turned = self.off_course_m > _WIGGLE_M and self.open.length_m > _WIGGLE_M
            if turned:
                self.close()
        mean = friction.mean if friction is not None else 0.0
        if abs(mean - self.first_friction) > _OTHER * self.first_friction:
            self.close()
        if self.open is None:
            self.first_friction = mean
        before = self.open or Leg(0.0, 0.0, 0.0, self.pressed_m, reach_m, None)
        x, y, turn = before.dx_m + step[0], before.dy_m + step[1], before.dtheta_rad + step[2]
        self.open = Leg(x, y, turn, indentation_m, reach_m, friction)
        length = self.open.length_m
        self.gone_m += max(length - before.length_m, 0.0) if length > _WIGGLE_M else 0.0
        pressed = abs(indentation_m - self.pressed_m) >= PRESS_M or _ends_apart(self.reach_m, reach_m) >= _LEG_REACH_M
        if length >= LEG_M or pressed:
            self.close()
        return turned

    def close(self) -> None:
        """Close the open leg."""
        if self.open is None:
            return
        leg, self.open = self.open, None
        self.off_course_m = 0.0
        self.legs.append(leg)
        self.pressed_m, self.reach_m = leg.indentation_m, leg.reach_m
        self.kept_m += leg.length_m
        while self.dropped < self.held and (
            self.kept_m - self.legs[0].length_m > MEMORY_M or len(self.legs) > MOST_LEGS
        ):
            first = self.legs.pop(0)
            self.dropped += 1
            self.kept_m -= first.length_m
            self.start = self.start.moved(first.dx_m, first.dy_m, first.dtheta_rad)
