"""The object's vertical motion under gravity, table and grip, one implicit step at a time.

The gel's friction is a function of the unknown velocity at the point theta of the step,
v' = v + theta dt (F(v') / m - g). F, the tangential force of all fingers, never rises with v'. The left side minus the
right is therefore monotone, and a bracketed Newton iteration always converges. theta = 1 is backward Euler, which damps
oscillations and never creates energy, unlike explicit LuGre and Haessig-Friedland schemes at these stiffnesses. theta =
1/2 is the midpoint rule, which keeps oscillations.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds_mocks.gel.protocol import GelModel, Reaction

GRAVITY_M_S2 = 9.81
"""Acceleration of gravity, m/s^2."""
TOLERANCE_M_S = 1e-11
"""Residual of the velocity at which the iteration ends, m/s; chosen."""
_LIFT_ITERATIONS = 60
"""Maximum number of iterations of a step; chosen."""


@dataclass(slots=True)
class ObjectMotion:
    """Vertical state of an object: height (m) of its foot above the table, upward velocity (m/s), whether it stands.

    Force and tangent stiffness of the last step's friction start the next step's search.
    """

    height_m: float = 0.0
    velocity_m_s: float = 0.0
    supported: bool = True
    force_n: float = 0.0
    stiffness_n_m: float = 0.0


def step_object(
    body: ObjectMotion,
    gel: GelModel,
    *,
    carrier_velocity_m_s: float,
    mass_kg: float,
    dt_s: float,
    fingers: int = 2,
    limit_n: float,
    theta: float = 1.0,
    push_n: float = 0.0,
) -> Reaction:
    """Advance `body` and `gel` by `dt_s`; return the reaction of one finger's gel.

    `carrier_velocity_m_s` is the upward velocity of the gel's base. The gel's y points down, so an object that lags
    behind moves along +y in the gel. `limit_n` bounds the friction force of one finger and brackets the solution.
    `push_n` acts downwards.
    """
    weight = mass_kg * GRAVITY_M_S2 + push_n
    if body.supported:
        reaction = gel.trial(0.0, dt_s * carrier_velocity_m_s)
        if fingers * reaction.force_y_n <= weight:
            gel.commit()
            body.velocity_m_s = 0.0
            return reaction
    velocity, reaction = _solve(body, gel, carrier_velocity_m_s, mass_kg, weight, theta * dt_s, fingers, limit_n)
    body.supported = body.height_m + dt_s * velocity <= 0.0
    if body.supported:
        velocity = -body.height_m / dt_s
    if body.supported or theta < 1.0:
        reaction = gel.trial(0.0, dt_s * (carrier_velocity_m_s - velocity))
    gel.commit()
    body.height_m = 0.0 if body.supported else body.height_m + dt_s * velocity
    end = body.velocity_m_s + (velocity - body.velocity_m_s) / theta
    body.velocity_m_s = 0.0 if body.supported else end  # the table absorbs the impact without a rebound
    body.force_n, body.stiffness_n_m = reaction.force_y_n, reaction.stiffness_y_n_m
    return reaction


def _solve(
    body: ObjectMotion,
    gel: GelModel,
    carrier_m_s: float,
    mass_kg: float,
    weight_n: float,
    dt_s: float,
    fingers: int,
    limit_n: float,
) -> tuple[float, Reaction]:
    """Return the velocity `dt_s` later and the reaction of the gel's last trial, which was at that velocity."""
    free = body.velocity_m_s - dt_s * weight_n / mass_kg
    gain = fingers * dt_s / mass_kg
    low, high = free - gain * limit_n - 1e-12, free + gain * limit_n + 1e-12
    slope = gain * dt_s * body.stiffness_n_m
    # The last step's tangent is almost always still valid, so that the first trial is already the solution.
    velocity = min(max((free + gain * body.force_n + slope * carrier_m_s) / (1.0 + slope), low), high)
    good_enough = max(TOLERANCE_M_S, gain * limit_n * gel.force_tolerance)
    under = over = False
    for _ in range(_LIFT_ITERATIONS):
        reaction = gel.trial(0.0, dt_s * (carrier_m_s - velocity))
        excess = velocity - free - gain * reaction.force_y_n
        if abs(excess) < good_enough:
            break
        # Shear may press the object harder against the gel, and so allow more friction than before the step.
        if excess > 0:
            high, over = velocity, True
            low = low if under else min(low, velocity - 2 * excess)
        else:
            low, under = velocity, True
            high = high if over else max(high, velocity - 2 * excess)
        velocity -= excess / (1.0 + gain * dt_s * reaction.stiffness_y_n_m)
        if not low < velocity < high:
            velocity = 0.5 * (low + high)
    else:
        reaction = gel.trial(0.0, dt_s * (carrier_m_s - velocity))
    return velocity, reaction
