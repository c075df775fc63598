"""Lifts: how much of the pad the object's end covers, against friction."""

from __future__ import annotations

from functools import partial

from lsds_mocks.gel.material import GelMaterial

from lsds_research.stability.grid import Axis
from lsds_research.stability.maps.lifts import lifted, slip_map, slip_mm
from lsds_research.stability.study import StabilityStudy

LENGTH_MM = 60.0
"""Length of the pipe, mm."""
HALF_PAD_MM = round(500 * GelMaterial().height_m, 3)
"""Half of the pad's height, mm."""


def measure(method: str, below_mm: float, friction_scale: float, seed: int) -> float:
    """Return the slip (mm) of a short pipe whose top stands `below_mm` under the upper edge of the pads."""
    settings = {
        "cell.simulated.length_mm": LENGTH_MM,
        "cell.simulated.grip_height_mm": LENGTH_MM + below_mm - HALF_PAD_MM,
        "cell.simulated.friction_scale": friction_scale,
    }
    return slip_mm(lifted(method, seed, settings))


MAP = slip_map(
    "edge",
    "Lift of a short pipe: slip by the uncovered part of the pad and friction",
    Axis("uncovered part of the pad's height", "mm", (0, 2, 4, 6, 8, 10), (0, 5, 10), (0, 8)),
    Axis("friction over that of the pipe", "", (0.6, 0.8, 1.0, 1.3, 1.6), (0.6, 1.0), (1.0,)),
    measure,
    firm=True,
    notes=("the contact lies at the pad's lower edge; beyond 10 mm the pads would close above the object",),
)
study = partial(StabilityStudy, MAP)
