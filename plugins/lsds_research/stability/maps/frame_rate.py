"""Lifts: frame interval against the share of frames that are lost."""

from __future__ import annotations

from functools import partial

from lsds_research.stability.grid import Axis
from lsds_research.stability.maps.lifts import lifted, slip_map, slip_mm
from lsds_research.stability.study import StabilityStudy


def measure(method: str, interval_ms: float, lost_percent: float, seed: int) -> float:
    """Return the slip of the pipe (mm)."""
    settings = {
        "sensor.mock-gelsight-mini.rate_hz": 1e3 / interval_ms,
        "sensor.mock-gelsight-mini.jitter_ms": 0.1 * interval_ms,
        "sensor.mock-gelsight-mini.drop_probability": lost_percent / 100,
        "sensor.mock-gelsight-mini.duplicate_probability": lost_percent / 200,
    }
    return slip_mm(lifted(method, seed, settings))


MAP = slip_map(
    "frame-rate",
    "Lift of the pipe: slip by frame interval and lost frames",
    Axis("frame interval", "ms", (15, 25, 40, 60, 80, 100, 120), (20, 40, 80), (40, 80)),
    Axis("lost frames", "%", (0, 10, 20, 30, 40), (0, 20), (0,)),
    measure,
    notes=(
        "exposure times jitter by a tenth of the interval (more of it: map frame-jitter)",
        "half as many frames as are lost repeat the one before",
    ),
)
study = partial(StabilityStudy, MAP)
