"""Lifts of spheres: their normal force decays while they slip."""

from __future__ import annotations

from functools import partial

from lsds_research.stability.grid import Axis
from lsds_research.stability.maps.lifts import lifted, slip_map, slip_mm
from lsds_research.stability.study import StabilityStudy


def measure(method: str, diameter_mm: float, mass_g: float, seed: int) -> float:
    """Return the slip of a smooth sphere of friction 0.6 (mm)."""
    sphere = {
        "cell.simulated.shape": "sphere",
        "cell.simulated.diameter_mm": float(diameter_mm),
        "cell.simulated.width_mm": float(diameter_mm),
        "cell.simulated.length_mm": max(20.0, float(diameter_mm)),
        "cell.simulated.grip_height_mm": max(20.0, diameter_mm) / 2,
        "cell.simulated.mass_kg": mass_g * 1e-3,
        "cell.simulated.stiffness_n_mm": 100.0,
        "cell.simulated.static_friction": 0.6,
        "cell.simulated.kinetic_friction": 0.5,
    }
    return slip_mm(lifted(method, seed, {}, cell=sphere))


MAP = slip_map(
    "spheres",
    "Lift of spheres (friction 0.6): slip by diameter and mass",
    Axis("diameter", "mm", (10, 15, 20, 25, 30, 40), (12, 25, 40), (12, 30)),
    Axis("mass", "g", (20, 50, 100, 200, 400, 800), (50, 400), (300,), log=True),
    measure,
    firm=True,
)
study = partial(StabilityStudy, MAP)
