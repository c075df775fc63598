"""Schemes that integrate dry friction with a tangential spring: the plant's, and others.

One object of mass m hangs on a spring k that slips at a limit; v is its velocity downward, z the spring's stretch. Each
scheme is a function (state, dt, limits) -> state. Only the return map is in the product.

- return map (elastic predictor, plastic corrector), theta 1 and 1/2: see `lsds_mocks.plant.lift`;
- Haessig and Friedland's reset integrator (1991), explicit;
- LuGre (Canudas de Wit and others 1995), forward Euler and semi-implicit, and with bristles stiff in proportion to the
  normal force, implicit;
- Moreau's time stepping of rigid Coulomb friction, without elastic deformation;
- event-driven: exact pieces of stick and slip, events looked for at the ends of steps only.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

GRAVITY_M_S2 = 9.81
"""Acceleration of gravity, m/s^2."""


@dataclass(frozen=True, slots=True)
class Setting:
    """Mass (kg), spring (N/m), friction at rest and sliding, Stribeck speed (m/s)."""

    mass_kg: float = 0.2
    stiffness_n_m: float = 2.1e3
    static: float = 0.55
    kinetic: float = 0.45
    stribeck_m_s: float = 0.01

    def sliding_n(self, normal_n: float, speed_m_s: float) -> float:
        """Return the friction force while sliding, of both fingers."""
        share = math.exp(-((speed_m_s / self.stribeck_m_s) ** 2))
        return 2 * normal_n * (self.kinetic + (self.static - self.kinetic) * share)


@dataclass(frozen=True, slots=True)
class Motion:
    """Downward displacement (m), velocity (m/s), stretch (m), friction force (N), whether it slides."""

    y_m: float = 0.0
    v_m_s: float = 0.0
    z_m: float = 0.0
    force_n: float = 0.0
    slides: bool = False


Scheme = Callable[[Setting, Motion, float, float], Motion]


def return_map(theta: float) -> Scheme:
    """Return the plant's scheme, forces taken at `theta` of the step."""

    def step(s: Setting, at: Motion, dt: float, normal: float) -> Motion:
        k, m, h = s.stiffness_n_m, s.mass_kg, theta * dt
        free = at.v_m_s + h * GRAVITY_M_S2
        force = k * (at.z_m + h * free) / (1 + h * h * k / m)
        limit = s.sliding_n(normal, at.v_m_s) if at.slides else 2 * normal * s.static
        sign = math.copysign(1.0, force)
        v = _slide(s, at.v_m_s, h, normal, sign)
        # Where friction would rise, as the object slows down, beyond what the spring pulls, the object sticks.
        if abs(force) <= limit or sign * k * (at.z_m + h * v) <= s.sliding_n(normal, v):
            v = free - h * force / m
            end = at.v_m_s + dt * (GRAVITY_M_S2 - force / m)
            return Motion(at.y_m + dt * v, end, at.z_m + dt * v, force, False)
        force = sign * s.sliding_n(normal, v)
        end = at.v_m_s + (v - at.v_m_s) / theta
        return Motion(at.y_m + dt * v, end, force / k, force, True)

    return step


def _slide(s: Setting, v: float, dt: float, normal: float, sign: float) -> float:
    """Solve v' = v + dt (g - F(v') / m) from the fast side, by bisection."""
    low = v + dt * (GRAVITY_M_S2 - sign * 2 * normal * s.static / s.mass_kg)
    high = v + dt * (GRAVITY_M_S2 - sign * 2 * normal * s.kinetic / s.mass_kg)
    low, high = min(low, high), max(low, high)
    for _ in range(60):
        middle = 0.5 * (low + high)
        excess = middle - v - dt * (GRAVITY_M_S2 - sign * s.sliding_n(normal, middle) / s.mass_kg)
        low, high = (low, middle) if excess > 0 else (middle, high)
    return 0.5 * (low + high)


def haessig_friedland(s: Setting, at: Motion, dt: float, normal: float) -> Motion:
    """Stretch follows the velocity, reset at the limit; force from the old stretch: explicit."""
    z = at.z_m + dt * at.v_m_s
    limit = s.sliding_n(normal, at.v_m_s) if at.slides else 2 * normal * s.static
    slides = abs(s.stiffness_n_m * z) > limit
    if slides:
        z = math.copysign(limit / s.stiffness_n_m, z)
    force = s.stiffness_n_m * z
    v = at.v_m_s + dt * (GRAVITY_M_S2 - force / s.mass_kg)
    return Motion(at.y_m + dt * at.v_m_s, v, z, force, slides)


def lugre(semi_implicit: bool) -> Scheme:
    """Return LuGre: z' = v - sigma |v| z / g(v), F = sigma z; forward, or velocity first."""

    def step(s: Setting, at: Motion, dt: float, normal: float) -> Motion:
        v = at.v_m_s
        if semi_implicit:
            v += dt * (GRAVITY_M_S2 - s.stiffness_n_m * at.z_m / s.mass_kg)
        g = s.sliding_n(normal, v)
        z = at.z_m + dt * (v - s.stiffness_n_m * abs(v) * at.z_m / g)
        force = s.stiffness_n_m * z
        if not semi_implicit:
            v += dt * (GRAVITY_M_S2 - s.stiffness_n_m * at.z_m / s.mass_kg)
        return Motion(at.y_m + dt * v, v, z, force, abs(force) >= 0.99 * g)

    return step


def scaled_lugre(s: Setting, at: Motion, dt: float, normal: float) -> Motion:
    """LuGre whose stiffness goes with the normal force (as at 6 N), solved implicitly for the velocity."""
    k = s.stiffness_n_m * normal / 6.0

    def stretch(v: float) -> float:
        return (at.z_m + dt * v) / (1 + dt * k * abs(v) / s.sliding_n(normal, v))

    v, low, high = at.v_m_s, at.v_m_s - dt * 50.0, at.v_m_s + dt * 50.0
    for _ in range(60):
        v = 0.5 * (low + high)
        excess = v - at.v_m_s - dt * (GRAVITY_M_S2 - k * stretch(v) / s.mass_kg)
        low, high = (low, v) if excess > 0 else (v, high)
    force = k * stretch(v)
    return Motion(at.y_m + dt * v, v, stretch(v), force, abs(force) > 0.99 * s.sliding_n(normal, v))


def moreau(s: Setting, at: Motion, dt: float, normal: float) -> Motion:
    """Rigid Coulomb friction: an impulse stops the object where it can."""
    free = at.v_m_s + dt * GRAVITY_M_S2
    limit = dt * 2 * normal * (s.kinetic if at.slides else s.static) / s.mass_kg
    v = 0.0 if abs(free) <= limit else free - math.copysign(limit, free)
    return Motion(at.y_m + dt * v, v, 0.0, s.mass_kg * (free - v) / dt, v != 0.0)


def event_driven(s: Setting, at: Motion, dt: float, normal: float) -> Motion:
    """Exact oscillation while it sticks, constant friction while it slides; what happens within a step goes unseen."""
    if not at.slides:
        w = math.sqrt(s.stiffness_n_m / s.mass_kg)
        rest = s.mass_kg * GRAVITY_M_S2 / s.stiffness_n_m
        off, c, n = at.z_m - rest, math.cos(w * dt), math.sin(w * dt)
        z, v = rest + off * c + at.v_m_s / w * n, at.v_m_s * c - off * w * n
        slides = abs(s.stiffness_n_m * z) > 2 * normal * s.static
        return Motion(at.y_m + z - at.z_m, v, z, s.stiffness_n_m * z, slides)
    force = math.copysign(s.sliding_n(normal, at.v_m_s), at.v_m_s)
    v = at.v_m_s + dt * (GRAVITY_M_S2 - force / s.mass_kg)
    stops = v * at.v_m_s <= 0
    moved = replace(at, y_m=at.y_m + dt * 0.5 * (at.v_m_s + v), v_m_s=v, z_m=force / s.stiffness_n_m, force_n=force)
    return replace(moved, slides=not stops)


SCHEMES: dict[str, Scheme] = {
    "return map, backward Euler": return_map(1.0),
    "return map, midpoint": return_map(0.5),
    "Haessig-Friedland, explicit": haessig_friedland,
    "LuGre, forward Euler": lugre(semi_implicit=False),
    "LuGre, semi-implicit": lugre(semi_implicit=True),
    "LuGre scaled by N, implicit": scaled_lugre,
    "Moreau, rigid": moreau,
    "event-driven": event_driven,
}
IN_PRODUCT = ("return map, backward Euler", "return map, midpoint")


HELD_N = 6.0
"""Normal force of a grip (N)."""
LOST_N = 0.8
"""Normal force of a grip that is almost lost (N)."""
GRIP_LOST_S = 0.6
"""Time at which the grip is lost (s)."""
GRIP_REGAINED_S = 0.76
"""Time at which the grip is regained (s)."""
SIMULATED_S = 1.4
"""End of the simulation (s)."""


def drop(scheme: Scheme, setting: Setting, dt_s: float) -> float:
    """Return the way (m) that the object drops while the grip is lost and regained; infinity if the scheme diverges."""
    at = Motion(z_m=setting.mass_kg * GRAVITY_M_S2 / setting.stiffness_n_m)
    for k in range(round(SIMULATED_S / dt_s)):
        at = scheme(setting, at, dt_s, LOST_N if GRIP_LOST_S <= (k + 0.5) * dt_s < GRIP_REGAINED_S else HELD_N)
        if not math.isfinite(at.y_m) or abs(at.y_m) > 1e3:
            return math.inf
    return at.y_m
