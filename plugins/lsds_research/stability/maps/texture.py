"""Lifts of a flat box: depth of its texture, which makes its slip visible, against its friction."""

from __future__ import annotations

from functools import partial

from lsds_research.stability.grid import Axis
from lsds_research.stability.maps.lifts import lifted, slip_map, slip_mm
from lsds_research.stability.study import StabilityStudy


def measure(method: str, depth_um: float, friction: float, seed: int) -> float:
    """Return the slip of a box of 200 g with bumps (mm)."""
    box = {
        "cell.simulated.shape": "box",
        "cell.simulated.diameter_mm": 30.0,
        "cell.simulated.width_mm": 40.0,
        "cell.simulated.length_mm": 80.0,
        "cell.simulated.grip_height_mm": 40.0,
        "cell.simulated.mass_kg": 0.2,
        "cell.simulated.stiffness_n_mm": 200.0,
        "cell.simulated.texture": "bumps" if depth_um else "smooth",
        "cell.simulated.texture_depth_mm": depth_um * 1e-3,
        "cell.simulated.static_friction": friction,
        "cell.simulated.kinetic_friction": round(friction / 1.2, 4),
    }
    return slip_mm(lifted(method, seed, {}, cell=box))


MAP = slip_map(
    "texture",
    "Lift of a flat box of 200 g: slip by depth of its texture and friction",
    Axis("depth of the texture", "um", (0, 20, 50, 100, 200), (0, 50, 200), (0, 100)),
    Axis("friction", "", (0.25, 0.35, 0.5, 0.7, 1.0), (0.35, 0.7), (0.25,)),
    measure,
    firm=True,
)
study = partial(StabilityStudy, MAP)
