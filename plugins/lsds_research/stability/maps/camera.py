"""Lifts: worn markers against light that swings."""

from __future__ import annotations

from functools import partial

from lsds_research.stability.grid import Axis
from lsds_research.stability.maps.lifts import lifted, slip_map, slip_mm
from lsds_research.stability.study import StabilityStudy


def measure(method: str, worn_percent: float, swing: float, seed: int) -> float:
    """Return the slip of the pipe (mm); a light that swings too much stops the cell, which counts as infinite."""
    settings = {
        "sensor.mock-gelsight-mini.wear": worn_percent / 100,
        "sensor.mock-gelsight-mini.swing_levels": swing,
    }
    return slip_mm(lifted(method, seed, settings))


MAP = slip_map(
    "camera",
    "Lift of the pipe: slip by worn markers and swinging light",
    Axis("worn markers", "%", (0, 10, 20, 30, 40, 50, 60), (0, 30, 60), (0, 30)),
    Axis("swing of the light", "levels", (0, 3, 6, 10, 15, 20, 30), (0, 10), (0,)),
    measure,
)
study = partial(StabilityStudy, MAP)
