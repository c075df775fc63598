"""Lifts: frame interval against the share of frames that are lost."""

from __future__ import annotations

from functools import partial

from lsds_research.stability.grid import Axis
from lsds_research.stability.maps.lifts import lifted, slip_map, slip_mm
from lsds_research.stability.study import StabilityStudy

INTERVALS = Axis("frame interval", "ms", (15, 25, 40, 60, 80, 100, 120), (20, 40, 80), (40, 80))


def slip_at(method: str, interval_ms: float, seed: int, *, jitter: float, lost: float = 0.0) -> float:
    """Return the slip of the pipe (mm); `jitter` is a share of the interval, `lost` one of the frames."""
    settings = {
        "sensor.mock-gelsight-mini.rate_hz": 1e3 / interval_ms,
        "sensor.mock-gelsight-mini.jitter_ms": jitter * interval_ms,
        "sensor.mock-gelsight-mini.drop_probability": lost,
        "sensor.mock-gelsight-mini.duplicate_probability": lost / 2,
    }
    return slip_mm(lifted(method, seed, settings))


def measure(method: str, interval_ms: float, lost_percent: float, seed: int) -> float:
    """Return the slip of the pipe (mm)."""
    return slip_at(method, interval_ms, seed, jitter=0.1, lost=lost_percent / 100)


MAP = slip_map(
    "frame-rate",
    "Lift of the pipe: slip by frame interval and lost frames",
    INTERVALS,
    Axis("lost frames", "%", (0, 10, 20, 30, 40), (0, 20), (0,)),
    measure,
    notes=(
        "exposure times jitter by a tenth of the interval (more of it: map frame-jitter)",
        "half as many frames as are lost repeat the one before",
    ),
)
study = partial(StabilityStudy, MAP)
