"""Trackers: limit of the share of markers that vanish while the gel moves."""

from __future__ import annotations

from functools import partial

import numpy as np

from lsds_research.stability.grid import Axis, StabilityMap
from lsds_research.stability.maps.moved_markers import LIMIT_SHARE, NAIVE, wrong_unflagged
from lsds_research.stability.study import StabilityStudy
from lsds_research.studies.frame.cost import TRACKERS

HEADING = np.radians(30.0)
"""Direction of the travel, along no row of markers."""


def measure(method: str, lost_percent: float, travel_px: float, seed: int) -> float:
    """Return the share of markers (%) that are at another's place and not flagged."""
    return 100 * wrong_unflagged(
        method, travel_px * np.array([np.cos(HEADING), np.sin(HEADING)]), lost_percent / 100, seed
    )


MAP = StabilityMap(
    "markers-lost",
    "Trackers: markers at another's place, unflagged, by share of markers that vanish and travel per frame",
    Axis("markers lost", "%", (0, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50), (0, 10, 20, 30, 40, 50), (20, 50)),
    Axis("travel per frame", "px", (0, 2, 4, 6, 8, 10, 12, 16), (0, 4, 8, 12), (2, 8)),
    TRACKERS,
    tuple(NAIVE),
    "wrong, unflagged",
    "%",
    100 * LIMIT_SHARE,
    measure,
)
study = partial(StabilityStudy, MAP)
