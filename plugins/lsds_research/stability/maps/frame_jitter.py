"""Lifts: frame interval against the jitter of the exposure times."""

from __future__ import annotations

from functools import partial

from lsds_research.stability.grid import Axis
from lsds_research.stability.maps.frame_rate import INTERVALS, slip_at
from lsds_research.stability.maps.lifts import slip_map
from lsds_research.stability.study import StabilityStudy


def measure(method: str, interval_ms: float, jitter_percent: float, seed: int) -> float:
    """Return the slip of the pipe (mm)."""
    return slip_at(method, interval_ms, seed, jitter=jitter_percent / 100)


MAP = slip_map(
    "frame-jitter",
    "Lift of the pipe: slip by frame interval and jitter",
    INTERVALS,
    Axis("jitter, of the interval", "%", (0, 5, 10, 20, 30), (0, 30), (20,)),
    measure,
    notes=("jitter is the standard deviation of the exposure time, cut off at 30 % of the interval",),
)
study = partial(StabilityStudy, MAP)
