"""How a sinusoidal traction moves the surface of an elastic layer bonded to a rigid base.

Plane strain in the direction of the wave, antiplane across it; z points into the gel, p > 0 presses. With x = q h and
D = (3-4v) cosh 2x + 2x^2 + 5 - 12v + 8v^2 the compliances are

    zz   (1-v) [(3-4v) sinh 2x - 2x] / (G q D)        pressure to depth
    par  (1-v) [(3-4v) sinh 2x + 2x] / (G q D)        shear along the wave to motion along it
    perp tanh x / (G q)                               shear across the wave
    c    [(1-2v)(3-4v)(cosh 2x - 1) - 2x^2] / (2GqD)  pressure to motion along the wave, times i

and h/M, h/G, h/G, 0 at q = 0, M = 2G (1-v)/(1-2v). Everything is scaled by e^-2x, so nothing overflows. Short waves
see a half-space, long ones a Winkler foundation. Here G = 1 and h = 1: multiply by h/G.
"""

from __future__ import annotations

import math

from numba import njit

#: x = q h beyond which the base is out of sight: e^-60 is nothing in double precision.
_DEEP = 30.0


@njit(cache=True)  # type: ignore[untyped-decorator]
def layer_symbol(qx: float, qy: float, poisson: float) -> tuple[float, float, float, float, float, float]:
    """Return xx, xy, yy, zz (real) and xz, yz (to be multiplied by i) for a wave (qx, qy) in units of 1/h."""
    x = math.hypot(qx, qy)
    if x == 0.0:
        return 1.0, 0.0, 1.0, 0.5 * (1 - 2 * poisson) / (1 - poisson), 0.0, 0.0
    deep = min(x, _DEEP)
    e = math.exp(-2 * deep)
    cosh, sinh = 0.5 * (1 + e * e), 0.5 * (1 - e * e)
    k = 3 - 4 * poisson
    scale = 1 / (x * (k * cosh + (2 * deep * deep + 5 - 12 * poisson + 8 * poisson * poisson) * e))
    zz = (1 - poisson) * (k * sinh - 2 * deep * e) * scale
    par = (1 - poisson) * (k * sinh + 2 * deep * e) * scale
    perp = math.tanh(deep) / x
    cross = 0.5 * ((1 - 2 * poisson) * k * (cosh - e) - 2 * deep * deep * e) * scale
    cx, cy = qx / x, qy / x
    return (
        par * cx * cx + perp * cy * cy,
        (par - perp) * cx * cy,
        par * cy * cy + perp * cx * cx,
        zz,
        cross * cx,
        cross * cy,
    )
