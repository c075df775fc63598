"""Lifts: frame interval against the jitter of the exposure times."""

from __future__ import annotations

from functools import partial

from lsds_research.stability.grid import Axis
from lsds_research.stability.maps.lifts import lifted, slip_map, slip_mm
from lsds_research.stability.study import StabilityStudy


def measure(method: str, interval_ms: float, jitter_percent: float, seed: int) -> float:
    """Return the slip of the pipe (mm)."""
    settings = {
        "sensor.mock-gelsight-mini.rate_hz": 1e3 / interval_ms,
        "sensor.mock-gelsight-mini.jitter_ms": jitter_percent / 100 * interval_ms,
    }
    return slip_mm(lifted(method, seed, settings))


MAP = slip_map(
    "frame-jitter",
    "Lift of the pipe: slip by frame interval and jitter",
    Axis("frame interval", "ms", (15, 25, 40, 60, 80, 100, 120), (20, 40, 80), (40, 80)),
    Axis("jitter, of the interval", "%", (0, 5, 10, 20, 30), (0, 30), (20,)),
    measure,
    notes=("jitter is the standard deviation of the exposure time, cut off at 30 % of the interval",),
)
study = partial(StabilityStudy, MAP)
