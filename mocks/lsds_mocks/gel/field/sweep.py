"""Friction contact on dense blocks: coupled nonlinear Gauss-Seidel over cells (Jourdan, Alart and Jean 1998).

Cell by cell, pressure and friction are set so that the cell alone is right, the others being as they are:

    p <- max(0, p - (w_z - b_z) / K_zz),    q <- disc of radius mu p nearest to q - (w_t - b_t) / K_tt,

and the displacement w of all cells follows at once. `b_z` is how deep the object stands over a cell, `b_t` where it
has carried a cell that sticks to it. Cells that are right to a fraction of the tolerance are passed over, so a scene in
which little happens costs little.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

_SKIP = 0.03
"""Part of the tolerance below which a change is not worth making."""
_FULL = 30
_DAMPED = 0.4
"""Cells that after so many sweeps still push each other to and fro, as under high friction at a free wall, where shear
raises the pressure that carries it, go a part of the way at a time."""


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def own(compliance: NDArray[np.float32], diagonal: NDArray[np.float32], known: int, count: int) -> None:
    """Write what each new cell does to itself, (n, 4): K_zz, K_tt, and pressure to motion along x and y."""
    for i in range(known, count):
        diagonal[i, 0] = compliance[i, 2, 2, i]
        cross = abs(compliance[i, 0, 1, i])
        diagonal[i, 1] = max(compliance[i, 0, 0, i], compliance[i, 1, 1, i]) + cross
        diagonal[i, 2] = compliance[i, 2, 0, i]
        diagonal[i, 3] = compliance[i, 2, 1, i]


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def respond(
    compliance: NDArray[np.float32], traction: NDArray[np.float32], w: NDArray[np.float32], known: int, count: int
) -> None:
    """Compute the displacement (3, n) of cells `known` to `count` afresh."""
    w[:, known:count] = 0.0
    for i in range(count):
        tx, ty, p = traction[0, i], traction[1, i], traction[2, i]
        if tx == 0.0 and ty == 0.0 and p == 0.0:
            continue
        for b in range(3):
            kx, ky, kz, out = compliance[i, 0, b], compliance[i, 1, b], compliance[i, 2, b], w[b]
            for j in range(known, count):
                out[j] += kx[j] * tx + ky[j] * ty + kz[j] * p


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def relax(
    compliance: NDArray[np.float32],
    diagonal: NDArray[np.float32],
    traction: NDArray[np.float32],
    w: NDArray[np.float32],
    target: NDArray[np.float32],
    friction: NDArray[np.float32],
    slid: NDArray[np.bool_],
    count: int,
    tolerance: float,
    sweeps: int,
) -> int:
    """Sweep until no traction changes by more than `tolerance` times the greatest pressure; return the sweeps done,
    or -1 where `sweeps` were not enough."""
    for done in range(1, sweeps + 1):
        greatest = np.float32(0.0)
        for i in range(count):
            greatest = max(greatest, traction[2, i])
        small = np.float32(tolerance) * greatest
        skip = np.float32(_SKIP) * small
        change = np.float32(0.0)
        share = np.float32(1.0) if done <= _FULL else np.float32(_DAMPED)
        for i in range(count):
            p = traction[2, i]
            new_p = max(np.float32(0.0), p - (w[2, i] - target[2, i]) / diagonal[i, 0])
            if new_p == 0.0 and p == 0.0:
                slid[i] = True
                continue
            dp = new_p - p
            kt = diagonal[i, 1]
            x = traction[0, i] - (w[0, i] + diagonal[i, 2] * dp - target[0, i]) / kt
            y = traction[1, i] - (w[1, i] + diagonal[i, 3] * dp - target[1, i]) / kt
            size, limit = np.sqrt(x * x + y * y), friction[i] * new_p
            slid[i] = size > limit
            if size > limit:
                x *= limit / size
                y *= limit / size
            if done > _FULL:
                new_p = p + share * dp
                dp = new_p - p
                x = traction[0, i] + share * (x - traction[0, i])
                y = traction[1, i] + share * (y - traction[1, i])
            dx, dy = x - traction[0, i], y - traction[1, i]
            step = max(abs(dp), max(abs(dx), abs(dy)))
            # Two things are never put off: letting go altogether, and coming back under a limit that has fallen, or
            # been guessed below nothing.
            held = friction[i] * max(p, np.float32(0.0)) * np.float32(1.00001)
            if step <= skip and new_p > 0.0 and traction[0, i] ** 2 + traction[1, i] ** 2 <= held * held:
                continue
            change = max(change, step)
            traction[0, i], traction[1, i], traction[2, i] = x, y, new_p
            for b in range(3):
                kx, ky, kz, out = compliance[i, 0, b], compliance[i, 1, b], compliance[i, 2, b], w[b]
                for j in range(count):
                    out[j] += kx[j] * dx + ky[j] * dy + kz[j] * dp
        if change <= small:
            return done
    return -1
