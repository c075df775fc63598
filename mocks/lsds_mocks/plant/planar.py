"""The object's motion in the plane of the pads: vertical, sideways, and rotation about the grip.

The step is implicit, like that of `lsds_mocks.plant.lift`, with three unknowns q at the point theta of the step: the
velocity of the centre of mass and the angular rate. They solve M (q - q_n) = theta dt (weight - fingers J^T R), where R
is the gel's reaction to the motion q. The solution is the minimum of a convex function, because friction within a step
grows with the object's motion. A quasi-Newton iteration finds it: it learns the gel's stiffness from its trials, passes
it on to the next step, and halves a step that overshoots.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.gel.placement import ORIGIN, Placement
from lsds_mocks.plant.lift import GRAVITY_M_S2, ObjectMotion

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.protocol import GelModel, Reaction

_EQUILIBRIUM_ITERATIONS = 40
"""Maximum number of quasi-Newton iterations of a step; chosen."""
_HALVINGS = 8
"""Maximum number of trial steps along the direction of an iteration; chosen."""
_EQUILIBRIUM_TOLERANCE = 1e-9
"""Residual force at which the iteration ends, relative to friction limit and weight; chosen."""
_LARGEST_STIFFNESS_N_M = 1e6
"""Upper bound on the learned stiffness, above that of any gel; the difference of two close trials may exceed it."""
_STIFFNESS_ARM_M = 5e-3
"""Lever arm of the initial rotational stiffness: the tangential stiffness times this arm squared."""


@dataclass(slots=True)
class PlanarMotion(ObjectMotion):
    """Planar state of an object, in addition to height and vertical velocity of the centre of mass.

    It adds the sideways velocity, the angular rate (x to y), the displacement of the object's point that was between
    the pads at the start, and whether the object is clamped to the table.
    """

    velocity_x_m_s: float = 0.0
    rate_rad_s: float = 0.0
    place: Placement = ORIGIN
    clamped: bool = False
    stiffness: NDArray[np.float64] = field(default_factory=lambda: np.zeros((3, 3)))


@dataclass(frozen=True, slots=True)
class Body:
    """Mass (kg), moment of inertia about the centre of mass (kg m^2), and initial position of the centre of mass
    relative to the pads' centre (m, x right, y down)."""

    mass_kg: float
    inertia_kg_m2: float
    centre_m: tuple[float, float]

    def centre_at(self, place: Placement) -> tuple[float, float]:
        """Return the position of the centre of mass of the object at `place`."""
        cos, sin = math.cos(place.angle_rad), math.sin(place.angle_rad)
        x, y = self.centre_m
        return place.x_m + cos * x - sin * y, place.y_m + sin * x + cos * y


def step_planar(
    motion: PlanarMotion,
    gel: GelModel,
    body: Body,
    *,
    carrier_velocity_m_s: float,
    carrier_rate_rad_s: float = 0.0,
    dt_s: float,
    fingers: int,
    limit_n: float,
    theta: float = 1.0,
    push_n: float = 0.0,
) -> Reaction:
    """Advance `motion` and `gel` by `dt_s`; return the reaction of one finger's gel.

    The carrier may rotate only if the object is clamped. Its velocity is along the pads' y, its rate from their x to y.
    `theta` 1 is backward Euler, 1/2 the midpoint rule. `push_n` acts downwards at the centre of mass.
    """
    weight = body.mass_kg * GRAVITY_M_S2 + push_n
    if motion.supported:
        # The table's friction prevents rotation and sideways motion.
        passed = (0.0, dt_s * carrier_velocity_m_s, dt_s * carrier_rate_rad_s)
        reaction = gel.trial(*passed)
        if motion.clamped or fingers * reaction.force_y_n <= weight:
            gel.commit()
            motion.place = motion.place.moved(*passed)
            motion.velocity_m_s = motion.velocity_x_m_s = motion.rate_rad_s = 0.0
            return reaction
    x, y = body.centre_at(motion.place)
    jacobian = np.array([[1.0, 0.0, y], [0.0, 1.0, -x], [0.0, 0.0, 1.0]])
    mass = np.array([body.mass_kg, body.mass_kg, body.inertia_kg_m2])
    start = np.array([motion.velocity_x_m_s, -motion.velocity_m_s, motion.rate_rad_s])
    carried = np.array([0.0, carrier_velocity_m_s, 0.0])
    middle = _solve(motion, gel, jacobian, mass, start, carried, theta * dt_s, fingers, weight, limit_n)
    rises = -float(middle[1])
    motion.supported = motion.height_m + dt_s * rises <= 0.0
    if motion.supported:
        middle[1] = motion.height_m / dt_s
    moved = (dt_s * (jacobian @ middle + carried)).tolist()
    reaction = gel.trial(*moved)
    gel.commit()
    motion.place = motion.place.moved(*moved)
    end = start + (middle - start) / theta
    motion.height_m = 0.0 if motion.supported else motion.height_m + dt_s * rises
    motion.velocity_m_s = 0.0 if motion.supported else -float(end[1])
    motion.velocity_x_m_s, motion.rate_rad_s = float(end[0]), float(end[2])
    return reaction


def _solve(
    motion: PlanarMotion,
    gel: GelModel,
    jacobian: NDArray[np.float64],
    mass: NDArray[np.float64],
    start: NDArray[np.float64],
    carried: NDArray[np.float64],
    h: float,
    fingers: int,
    weight: float,
    limit_n: float,
) -> NDArray[np.float64]:
    """Return the velocities at the step's point theta, `h` after its beginning."""
    load = np.array([0.0, weight, 0.0])
    good_enough = max(_EQUILIBRIUM_TOLERANCE, gel.force_tolerance) * (limit_n + weight) * fingers
    scale = np.array([1.0, 1.0, _STIFFNESS_ARM_M])
    stiffness = motion.stiffness

    def excess(guess: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return the residual of the balance, the motion, and the gel's reaction to it."""
        moved = h * (jacobian @ guess + carried)
        answer = gel.trial(*moved.tolist())
        if not motion.stiffness.any():
            motion.stiffness = answer.stiffness_y_n_m * np.diag([1.0, 1.0, _STIFFNESS_ARM_M**2])
        force = np.array([answer.force_x_n, answer.force_y_n, answer.torque_nm])
        return mass * (guess - start) / h - load + fingers * jacobian.T @ force, moved, force

    guess = start
    left, moved, force = excess(guess)
    stiffness = motion.stiffness
    for _ in range(_EQUILIBRIUM_ITERATIONS):
        if np.abs(left / scale).max() <= good_enough:
            break
        tangent = np.diag(mass / h) + fingers * h * jacobian.T @ stiffness @ jacobian
        ahead = -np.linalg.solve(tangent, left)
        slope, share = float(left @ ahead), 1.0
        taken, tried, new_moved, new_force = 0.0, left, moved, force
        for _ in range(_HALVINGS):
            tried, new_moved, new_force = excess(guess + share * ahead)
            stiffness = _learn(stiffness, new_moved - moved, new_force - force, scale)
            beyond = float(tried @ ahead)
            taken = share
            if beyond <= 0.5 * abs(slope):
                break
            share *= max(0.1, slope / (slope - beyond))
        guess, left, moved, force = guess + taken * ahead, tried, new_moved, new_force
    motion.stiffness = stiffness
    return np.array(guess)


def _learn(
    stiffness: NDArray[np.float64], moved: NDArray[np.float64], force: NDArray[np.float64], scale: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the stiffness that also explains the last two trials (Powell's symmetric Broyden update), within bounds.

    Rotation is scaled by a lever arm, so that metres and radians have comparable weight.
    """
    d, f = moved * scale, force / scale
    size = float(d @ d)
    if size < 1e-24:
        return stiffness
    own = stiffness / np.outer(scale, scale)
    miss = f - own @ d
    own = own + (np.outer(miss, d) + np.outer(d, miss)) / size - float(miss @ d) / size**2 * np.outer(d, d)
    values, vectors = np.linalg.eigh(own)
    own = (vectors * np.clip(values, 0.0, _LARGEST_STIFFNESS_N_M)) @ vectors.T
    return np.asarray(own * np.outer(scale, scale))
