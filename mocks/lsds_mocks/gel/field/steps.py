"""Small sums over the cells of a patch, each in one pass: a frame of a small contact is mostly these."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray


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
    """Write where the object has carried the anchors (2, n) to, into `carried` and the first two rows of `target`."""
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

    `sloped`: pressure on a slope pushes sideways, which an object feels that is moved over its own dent.
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
    """Write which cells slide: those that slid in this increment and have fallen back by more than `least` since `slip`
    was written, which is written anew."""
    for i in range(slip.size):
        now = math.hypot(carried[0, i] - w[0, i], carried[1, i] - w[1, i])
        sliding[i] = slid[i] and now - slip[i] > least
        slip[i] = now


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
    """Begin a new increment here: anchors of cells that slid go where the surface is, the others where they were
    carried; tractions and displacements are kept as the old ones."""
    for i in range(slip.size):
        for a in range(2):
            anchor[a, i] = w[a, i] if slid[i] else carried[a, i]
        for a in range(3):
            old_traction[a, i], old_w[a, i] = traction[a, i], w[a, i]
        slip[i] = 0.0
