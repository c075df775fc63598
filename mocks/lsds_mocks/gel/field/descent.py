"""Steps of a projected, preconditioned descent: the loops over cells between two elastic responses.

Traction y (3, n) is admissible if p >= 0 and |q| <= limit. Its residual r = w - b (3, n), in metres, is the gradient
of the elastic energy less the work of the target. All arrays are in single precision: x, y, and pressure or depth.
Loops are vectorised because they have no branches and no division checks, and find a maximum in a separate loop.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Field = NDArray[np.float32]

_0, _1, _2, _4 = np.float32(0.0), np.float32(1.0), np.float32(2.0), np.float32(4.0)
_TINY = np.float32(1e-30)
_ROUNDING = np.float32(1e-6)
_SLOWER, _FASTER = np.float32(0.5), np.float32(1.3)
_EDGE = np.float32(0.2)
"""Distance to a bound, as part of the limit or of the greatest pressure, within which a cell counts as on the bound if
its own next step would reach it. Steps end slightly inside the discs, so no cell would meet an exact bound."""


@njit(cache=True)  # type: ignore[untyped-decorator]
def lay_out(
    at: NDArray[np.int32],
    traction: Field,
    w: Field,
    target: Field,
    friction: Field,
    y: Field,
    r: Field,
    targets: Field,
    frictions: Field,
) -> None:
    """Copy traction, residual, target and friction of the cells `at` (n,) to their places in a rectangle.

    Inactive cells have no traction, and the residual that follows from their target.
    """
    y[:] = _0
    for i in range(at.size):
        frictions[at[i]] = friction[i]
    for a in range(3):
        for i in range(at.size):
            y[a, at[i]] = traction[a, i]
            targets[a, at[i]] = target[a, i]
        for k in range(targets.shape[1]):
            r[a, k] = -targets[a, k]
        for i in range(at.size):
            r[a, at[i]] += w[a, i]


@njit(cache=True)  # type: ignore[untyped-decorator]
def take_in(
    at: NDArray[np.int32],
    y: Field,
    r: Field,
    limit: Field,
    kt: float,
    target: Field,
    traction: Field,
    w: Field,
    slid: NDArray[np.bool_],
) -> None:
    """Inverse of `lay_out`: write traction and displacement of the cells `at`, and which slide or do not touch."""
    rest, bound = np.empty((3, at.size), np.float32), np.empty(at.size, np.float32)
    for a in range(3):
        for i in range(at.size):
            traction[a, i], rest[a, i] = y[a, at[i]], r[a, at[i]]
            w[a, i] = rest[a, i] + target[a, i]
    for i in range(at.size):
        bound[i] = limit[at[i]]
    slides(traction, rest, bound, kt, slid)


@njit(cache=True, fastmath=True, error_model="numpy")  # type: ignore[untyped-decorator]
def confine(
    y: Field, r: Field, friction: Field, kt: float, patient: bool, pace: Field, limit: Field, moved: Field
) -> tuple[float, float]:
    """Set the limits from the pressures and make `y` admissible, with sliding cells on their limits.

    Write the change of `y` to `moved`; return the greatest pressure and the greatest change. If `patient`, a limit
    makes only a part of its change. That part shrinks when the change reverses and grows when it does not; `pace`
    (2, n) keeps the part and the last change.
    """
    ct = np.float32(1 / kt)
    for i in range(limit.size):
        p = max(_0, y[2, i])
        g = friction[i] * p
        if patient:
            way = g - limit[i]
            turned = way * pace[1, i]
            part = pace[0, i] * (_SLOWER if turned < _0 else (_FASTER if turned > _0 else _1))
            pace[0, i], pace[1, i] = part, way
            g = max(_0, limit[i] + min(part, _2) * way)
        x, z = y[0, i], y[1, i]
        size = np.sqrt(x * x + z * z + _TINY)
        pull = -(x * r[0, i] + z * r[1, i]) / size
        f = g / size
        f = f if (size >= (_1 - _EDGE) * g) & (size + ct * pull > g) else min(_1, f)
        # A cell within rounding of its limit stays unchanged, so that it needs no elastic response.
        f = _1 if abs(f - _1) < _ROUNDING else f
        moved[0, i], moved[1, i], moved[2, i] = (f - _1) * x, (f - _1) * z, p - y[2, i]
        limit[i] = g
        y[0, i], y[1, i], y[2, i] = f * x, f * z, p
    greatest, change = _0, _0
    for i in range(limit.size):
        greatest = max(greatest, y[2, i])
    for a in range(3):
        for i in range(limit.size):
            change = max(change, abs(moved[a, i]))
    return float(greatest), float(change)


@njit(cache=True, fastmath=True, error_model="numpy")  # type: ignore[untyped-decorator]
def misfit(
    y: Field, r: Field, factor: Field, follows: bool, kt: float, kz: float, arm: Field, even: float, change: Field
) -> float:
    """Return the greatest change (Pa) in the traction of a cell when only that cell is corrected.

    If `even` times the average change is greater, return that instead. `change` is overwritten. `factor` is the limit
    or, if the limit `follows` the pressure, the friction coefficient. `arm` (2, n) holds the cells' positions, scaled
    to a mean square of 1, for the average change in torque.
    """
    ct, cz = np.float32(1 / kt), np.float32(1 / kz)
    follow, hold = (_1, _0) if follows else (_0, _1)
    sum_x, sum_y, sum_p, turn, touching = _0, _0, _0, _0, _0
    for i in range(change.size):
        p = max(_0, y[2, i] - cz * r[2, i])
        x, z = y[0, i] - ct * r[0, i], y[1, i] - ct * r[1, i]
        f = min(_1, factor[i] * (hold + follow * p) / np.sqrt(x * x + z * z + _TINY))
        x, z, p = f * x - y[0, i], f * z - y[1, i], p - y[2, i]
        change[i] = max(max(abs(x), abs(z)), abs(p))
        sum_x += x
        sum_y += z
        sum_p += p
        turn += arm[0, i] * z - arm[1, i] * x
        touching += _1 if y[2, i] > _0 else _0
    greatest = _0
    for i in range(change.size):
        greatest = max(greatest, change[i])
    most = max(max(abs(sum_x), abs(sum_y)), max(abs(sum_p), abs(turn)))
    return float(max(greatest, np.float32(even) * most / max(touching, _1)))


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def slides(y: Field, r: Field, limit: Field, kt: float, slid: NDArray[np.bool_]) -> None:
    """Write which cells slide, or do not touch."""
    ct = np.float32(1 / kt)
    for i in range(limit.size):
        x, z = y[0, i] - ct * r[0, i], y[1, i] - ct * r[1, i]
        slid[i] = y[2, i] <= _0 or x * x + z * z > limit[i] * limit[i]


@njit(cache=True, fastmath=True, error_model="numpy")  # type: ignore[untyped-decorator]
def reduce(
    y: Field, r: Field, limit: Field, kt: float, kz: float, greatest: float, face: Field, gradient: Field, scaled: Field
) -> None:
    """Find the face of the admissible set that `y` is on, and the gradient along it.

    `face` (4, n) holds: outward direction (x, y) of a sliding cell, else zero; weight of motion along the surface, zero
    without traction and below one if a disc's curvature makes its edge stiff; one, or zero if the cell's pressure ends.
    `gradient` is `r` along the face, `scaled` the gradient times the weight.
    """
    stiff, cz = np.float32(kt), np.float32(1 / kz)
    ct = _1 / stiff
    near = _EDGE * np.float32(greatest)
    for i in range(limit.size):
        p, g = y[2, i], limit[i]
        free = _1 if (p > near) | (p > cz * r[2, i]) else _0
        size = np.sqrt(y[0, i] * y[0, i] + y[1, i] * y[1, i] + _TINY)
        ex, ey = y[0, i] / size, y[1, i] / size
        pull = -(r[0, i] * ex + r[1, i] * ey)
        slips = _1 if (size >= (_1 - _EDGE) * g) & (size + ct * pull > g) else _0
        on = _1 if g > _0 else _0
        weight = on * np.sqrt(stiff / (stiff + slips * max(_0, pull) / max(g, _TINY)))
        gx, gy, gz = on * (r[0, i] + slips * pull * ex), on * (r[1, i] + slips * pull * ey), free * r[2, i]
        face[0, i], face[1, i], face[2, i], face[3, i] = slips * ex, slips * ey, weight, free
        gradient[0, i], gradient[1, i], gradient[2, i] = gx, gy, gz
        scaled[0, i], scaled[1, i], scaled[2, i] = weight * gx, weight * gy, gz


@njit(cache=True, fastmath=True, error_model="numpy")  # type: ignore[untyped-decorator]
def direct(z: Field, gradient: Field, before: Field, product: float, d: Field, face: Field) -> float:
    """Replace `d` by the next conjugate direction (Polak and Ribiere); `z` is the preconditioned gradient.

    `before` and `product` are the last gradient and its product with the last `z`, 0 to start. Return the new product.
    """
    now, cross = _0, _0
    for i in range(z.shape[1]):
        ex, ey, weight, free = face[0, i], face[1, i], face[2, i], face[3, i]
        x, y, p = weight * z[0, i], weight * z[1, i], free * z[2, i]
        along = x * ex + y * ey
        x, y = x - along * ex, y - along * ey
        z[0, i], z[1, i], z[2, i] = x, y, p
        now += x * gradient[0, i] + y * gradient[1, i] + p * gradient[2, i]
        cross += x * before[0, i] + y * before[1, i] + p * before[2, i]
    beta = max(_0, now - cross) / np.float32(product) if product > 0.0 else _0
    slope = _0
    for i in range(z.shape[1]):
        ex, ey, free = face[0, i], face[1, i], beta * face[3, i]
        on = beta if face[2, i] > _0 else _0
        along = d[0, i] * ex + d[1, i] * ey
        x, y = on * (d[0, i] - along * ex) - z[0, i], on * (d[1, i] - along * ey) - z[1, i]
        p = free * d[2, i] - z[2, i]
        d[0, i], d[1, i], d[2, i] = x, y, p
        slope += x * gradient[0, i] + y * gradient[1, i] + p * gradient[2, i]
    if slope >= _0:
        d[:] = -z
    return float(now)


@njit(cache=True, fastmath=True)  # type: ignore[untyped-decorator]
def steepest(gradient: Field, face: Field, kt: float, kz: float, d: Field) -> None:
    """Write the direction `d` of each cell's own step of length 1, along which the energy never rises."""
    ct, cz = np.float32(1 / kt), np.float32(1 / kz)
    for i in range(d.shape[1]):
        c = ct * face[2, i] * face[2, i]
        d[0, i], d[1, i], d[2, i] = -c * gradient[0, i], -c * gradient[1, i], -cz * gradient[2, i]


@njit(cache=True, fastmath=True, error_model="numpy")  # type: ignore[untyped-decorator]
def aim(y: Field, r: Field, d: Field, length: float, limit: Field, face: Field, step: Field) -> float:
    """Write the `step` from `y` to the admissible traction nearest to y + length d, on the edges of the face.

    Return the slope of the energy along it.
    """
    a = np.float32(length)
    slope = _0
    for i in range(limit.size):
        x, z, g = y[0, i], y[1, i], limit[i]
        ux, uz = a * d[0, i], a * d[1, i]
        size = np.sqrt((x + ux) * (x + ux) + (z + uz) * (z + uz) + _TINY)
        # The limit's square less that of `size`, except for rounding at the limit: if a cell far behind the object
        # pulls outward, correcting that rounding would take more work than the step saves.
        inside = g * g - x * x - z * z
        inside = inside if inside > _4 * _ROUNDING * g * g else _0
        beyond = inside - _2 * (x * ux + z * uz) - ux * ux - uz * uz
        slips = face[0, i] * face[0, i] + face[1, i] * face[1, i] > _0
        f = (beyond if slips else min(_0, beyond)) / (size * (g + size))
        # This form loses neither a small rotation nor a long way back to a small disc to rounding.
        f, back = (f, _0) if size < _2 * g else (g / size, _1)
        x, z = f * (x + ux) + (_1 - back) * ux - back * x, f * (z + uz) + (_1 - back) * uz - back * z
        p = face[3, i] * max(_0, y[2, i] + a * d[2, i]) - y[2, i]
        step[0, i], step[1, i], step[2, i] = x, z, p
        slope += x * r[0, i] + z * r[1, i] + p * r[2, i]
    return float(slope)


@njit(cache=True, fastmath=True, error_model="numpy")  # type: ignore[untyped-decorator]
def advance(y: Field, r: Field, step: Field, answer: Field, slope: float) -> tuple[float, float]:
    """Move along `step`, whose elastic response is `answer`, to the least energy, but not beyond its end.

    Return the position of the unlimited minimum, as part of the step, and the greatest pressure.
    """
    curvature = _0
    for i in range(y.shape[1]):
        curvature += step[0, i] * answer[0, i] + step[1, i] * answer[1, i] + step[2, i] * answer[2, i]
    best = -np.float32(slope) / max(curvature, _TINY)
    part = max(_0, min(_1, best))
    for a in range(3):
        for i in range(y.shape[1]):
            y[a, i] += part * step[a, i]
            r[a, i] += part * answer[a, i]
    greatest = _0
    for i in range(y.shape[1]):
        greatest = max(greatest, y[2, i])
    return float(best), float(greatest)
