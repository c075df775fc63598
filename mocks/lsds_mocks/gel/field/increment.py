"""Increments of motion, after which the gel updates its history.

Friction with memory is integrated over increments of motion, not of time. All solutions within an increment start from
its beginning, so small steps do not accumulate small errors, and the result does not depend on the frame rate. On
straight paths increments of 0.3 mm cause an error below a micrometre. An increment ends at a turn, so that no turn is
cut short.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray


LONG_M = 0.04e-3
"""Motion, or change of the indentation, at which an increment ends."""
BACK_M = 1e-6
"""Motion back from the farthest point at which an increment ends."""
TURN_ARM_M = 2e-3
"""Lever arm that converts rotation to motion."""
_TURN = math.cos(math.radians(30))
"""Cosine of the largest angle between an increment and a step that does not end it, 30 degrees; chosen."""


class Increment(NamedTuple):
    """Motion (m, rad) since an increment began, change of indentation (m), and the farthest distance so far (m)."""

    dx_m: float = 0.0
    dy_m: float = 0.0
    dtheta_rad: float = 0.0
    pressed_m: float = 0.0
    farthest_m: float = 0.0

    def and_then(self, dx_m: float, dy_m: float, dtheta_rad: float) -> Increment:
        """Return the increment with one more step."""
        x, y, turn = self.dx_m + dx_m, self.dy_m + dy_m, self.dtheta_rad + dtheta_rad
        length = math.sqrt(x * x + y * y + (TURN_ARM_M * turn) ** 2)
        return Increment(x, y, turn, self.pressed_m, max(self.farthest_m, length))

    @property
    def length_m(self) -> float:
        """Distance (m) from its beginning."""
        return math.sqrt(self.dx_m**2 + self.dy_m**2 + (TURN_ARM_M * self.dtheta_rad) ** 2)

    def is_over(self, pressed_m: float) -> bool:
        """Return whether the increment ends here after a change of the indentation by `pressed_m`."""
        length = self.length_m
        return length >= LONG_M or abs(pressed_m) >= LONG_M or self.farthest_m - length > BACK_M

    def turns_with(self, dx_m: float, dy_m: float, dtheta_rad: float) -> bool:
        """Return whether a step turns so sharply that the increment has to end before it."""
        size = math.sqrt(dx_m * dx_m + dy_m * dy_m + (TURN_ARM_M * dtheta_rad) ** 2)
        length = self.length_m
        if size < BACK_M or length < BACK_M:
            return False
        along = dx_m * self.dx_m + dy_m * self.dy_m + TURN_ARM_M * TURN_ARM_M * dtheta_rad * self.dtheta_rad
        return along < _TURN * size * length

    def share_of(self, last: Increment) -> float:
        """Return the part of the last increment that this one repeats, 0 to 1."""
        own = (self.dx_m, self.dy_m, TURN_ARM_M * self.dtheta_rad, self.pressed_m)
        other = (last.dx_m, last.dy_m, TURN_ARM_M * last.dtheta_rad, last.pressed_m)
        size = sum(o * o for o in other)
        along = sum(a * b for a, b in zip(own, other, strict=True))
        return min(max(along / size, 0.0), 1.0) if size > 0 else 0.0


@njit(cache=True)  # type: ignore[untyped-decorator]
def carry(
    anchor: NDArray[np.float64],
    points: NDArray[np.float64],
    dx: float,
    dy: float,
    dtheta: float,
    carried: NDArray[np.float64],
    target: NDArray[np.float32],
) -> None:
    """Write the anchors (2, n) as moved by the object into `carried` and the first two rows of `target`."""
    for i in range(anchor.shape[1]):
        carried[0, i] = anchor[0, i] + dx - dtheta * points[1, i]
        carried[1, i] = anchor[1, i] + dy + dtheta * points[0, i]
        target[0, i], target[1, i] = carried[0, i], carried[1, i]


@njit(cache=True)  # type: ignore[untyped-decorator]
def add_up(
    traction: NDArray[np.float32],
    points: NDArray[np.float64],
    slope: NDArray[np.float32],
    slid: NDArray[np.bool_],
    sloped: bool,
) -> tuple[float, float, float, float, int]:
    """Return sums of traction along x and y, of its moment about the origin, of pressure, and the count of stuck cells.

    `sloped`: add the sideways force of pressure on a slope, which acts on an object that moves over its own dent.
    """
    fx = fy = torque = normal = 0.0
    stuck = 0
    for i in range(traction.shape[1]):
        p = float(traction[2, i])
        tx, ty = float(traction[0, i]), float(traction[1, i])
        if sloped:
            tx += p * slope[0, i]
            ty += p * slope[1, i]
        fx += tx
        fy += ty
        torque += points[0, i] * ty - points[1, i] * tx
        normal += p
        stuck += not slid[i]
    return fx, fy, torque, normal, stuck


@njit(cache=True)  # type: ignore[untyped-decorator]
def notice_sliding(
    carried: NDArray[np.float64],
    w: NDArray[np.float32],
    slid: NDArray[np.bool_],
    least: float,
    slip: NDArray[np.float64],
    sliding: NDArray[np.bool_],
) -> None:
    """Write which cells slide: those that slid in this increment and have lagged by more than `least` since the last
    call; update `slip`."""
    for i in range(slip.size):
        now = math.hypot(carried[0, i] - w[0, i], carried[1, i] - w[1, i])
        sliding[i] = slid[i] and now - slip[i] > least
        slip[i] = now


@njit(cache=True)  # type: ignore[untyped-decorator]
def stick_share(traction: NDArray[np.float32], sliding: NDArray[np.bool_]) -> float:
    """Return the share of the cells in contact that do not slide; 1 without contact."""
    touching = sticking = 0
    for i in range(sliding.size):
        if traction[2, i] > 0:
            touching += 1
            sticking += not sliding[i]
    return sticking / touching if touching else 1.0


@njit(cache=True)  # type: ignore[untyped-decorator]
def settle(
    anchor: NDArray[np.float64],
    carried: NDArray[np.float64],
    slid: NDArray[np.bool_],
    traction: NDArray[np.float32],
    w: NDArray[np.float32],
    old_traction: NDArray[np.float32],
    old_w: NDArray[np.float32],
    slip: NDArray[np.float64],
) -> None:
    """Begin a new increment: keep tractions and displacements as the old ones and set the anchors.

    Anchors of cells that slid move to the surface's displacement, the others to their carried positions.
    """
    for i in range(slip.size):
        for a in range(2):
            anchor[a, i] = w[a, i] if slid[i] else carried[a, i]
        for a in range(3):
            old_traction[a, i], old_w[a, i] = traction[a, i], w[a, i]
        slip[i] = 0.0
