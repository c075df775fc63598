"""Random objects for the study `grip`: drawn from wide ranges, and tested with a firm grip.

Ranges: what a Hand-E can hold between two GelSight Minis. Thickness, mass, friction, and stiffness are log-uniform, so
that light, slippery, and soft objects are as frequent as heavy ones. A draw serves development or evaluation, never
both; a draw whose results led to a decision becomes a development draw.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lsds.config.overrides import override_texts
from lsds_research.studies.grip.lift import Lift

DEVELOPMENT = frozenset({0, *range(1000, 1016)})
"""Draws on which controllers were tuned."""
SHAPES = ("cylinder", "sphere", "box", "edge")
TEXTURES = ("smooth", "bumps", "pores", "weave")
THICKNESS_MM = (8.0, 44.0)
"""Range of the thickness between the fingers, mm; chosen within the stroke of a Hand-E."""
MASS_KG = (0.02, 1.2)
"""Range of the mass, kg; chosen."""
FRICTION_RANGE = (0.2, 1.1)
"""Range of the static friction; chosen."""
KINETIC_SHARE = (0.7, 0.95)
"""Range of kinetic over static friction; chosen."""
STIFFNESS_N_MM = (3.0, 1000.0)
"""Range of the object's stiffness, N/mm; chosen."""
GRAIN_UM = (0.0, 12.0)
"""Range of the fine relief of the surface, um; chosen."""
SQUEEZE_MM = (0.7, 2.8)
"""Range of the first squeeze, mm; chosen."""
LIFT_SPEED_RANGE_M_S = (0.02, 0.08)
"""Range of the arm's velocity in the lift, m/s; chosen."""
GRAVITY_M_S2 = 9.81
"""Acceleration of gravity, m/s^2."""
FIRM_SQUEEZES_MM = (3.0, 6.0, 10.0)
"""Squeezes of a firm grip: an object that none of them holds is left out."""


@dataclass(frozen=True, slots=True)
class RandomObject:
    """A drawn object, its first squeeze, and its lifting speed; `cell` are options of `[cell.simulated]`."""

    draw: int
    index: int
    gel: int
    squeeze_mm: float
    speed_m_s: float
    weight_n: float
    cell: tuple[tuple[str, Any], ...]

    @property
    def name(self) -> str:
        """Return its name in tables."""
        return f"random-{self.draw}-{self.index}"

    def overrides(self) -> tuple[str, ...]:
        """Return the config's keys of the object."""
        return tuple(override_texts({f"cell.simulated.{key}": value for key, value in self.cell}))

    def lift(self, controller: str, squeeze_mm: float, settings: tuple[str, ...] = ()) -> Lift:
        """Return its lift by a controller from a first squeeze (mm); `settings` are keys of the config."""
        return Lift(
            controller,
            self.name,
            squeeze_mm,
            self.speed_m_s,
            1.0,
            "none",
            self.gel,
            self.weight_n,
            settings=settings,
            cell=self.overrides(),
        )


def drawn(draw: int, index: int) -> RandomObject:
    """Return object `index` of a draw; the same numbers always give the same object."""
    rng = np.random.default_rng((draw, index))

    def between(bounds: tuple[float, float]) -> float:
        return float(rng.uniform(*bounds))

    def log_between(bounds: tuple[float, float]) -> float:
        return float(np.exp(rng.uniform(*np.log(bounds))))

    shape = str(rng.choice(SHAPES))
    thickness_mm = round(log_between(THICKNESS_MM), 2)
    length_mm = round(max(20.0, thickness_mm if shape == "sphere" else between((60.0, 220.0))), 2)
    friction = log_between(FRICTION_RANGE)
    mass_kg = log_between(MASS_KG)
    texture = str(rng.choice(TEXTURES))
    cell = {
        "shape": shape,
        "diameter_mm": thickness_mm,
        "length_mm": length_mm,
        "grip_height_mm": min(50.0, length_mm / 2),
        "width_mm": round(between((8.0, 100.0)), 2),
        "edge_mm": round(between((0.3, 4.0)), 2),
        "turned_deg": 0.0 if shape == "sphere" else round(between((-30.0, 30.0)), 1),
        "texture": texture,
        "texture_size_mm": round(between((0.5, 4.0)), 2),
        "texture_depth_mm": 0.0 if texture == "smooth" else round(between((0.02, 0.2)), 3),
        "grain_um": round(between(GRAIN_UM), 2),
        "mass_kg": round(mass_kg, 4),
        "stiffness_n_mm": round(log_between(STIFFNESS_N_MM), 2),
        "static_friction": round(friction, 4),
        "kinetic_friction": round(friction * between(KINETIC_SHARE), 4),
        "texture_amplitude": round(between((0.0, 0.15)), 3),
        "chatter_amplitude": round(between((0.1, 0.4)), 3),
    }
    gel = int(rng.integers(1, 1000))
    squeeze_mm, speed = log_between(SQUEEZE_MM), log_between(LIFT_SPEED_RANGE_M_S)
    weight_n = round(mass_kg * GRAVITY_M_S2, 3)
    return RandomObject(draw, index, gel, round(squeeze_mm, 3), round(speed, 4), weight_n, tuple(cell.items()))
