"""Trackers: limit of the markers' travel from one frame to the next."""

from __future__ import annotations

from functools import partial

import numpy as np

from lsds_research.stability.grid import Axis, StabilityMap
from lsds_research.stability.maps.moved_markers import LIMIT_SHARE, NAIVE, wrong_unflagged
from lsds_research.stability.study import StabilityStudy
from lsds_research.studies.frame.cost import TRACKERS


def measure(method: str, travel_px: float, heading_deg: float, seed: int) -> float:
    """Return the share of markers (%) that are confused with their neighbours and not flagged."""
    heading = np.radians(heading_deg)
    return 100 * wrong_unflagged(method, travel_px * np.array([np.cos(heading), np.sin(heading)]), 0.0, seed)


MAP = StabilityMap(
    "marker-travel",
    "Trackers: markers at another's place, unflagged, by travel per frame",
    Axis(
        "travel per frame",
        "px",
        tuple(np.linspace(0, 41, 15).round(1).tolist()),
        (0, 6, 12, 18, 24, 30, 41),
        (10, 20, 36),
    ),
    Axis("heading", "deg", (0, 15, 30, 45, 60, 75, 90, 120, 150), (0, 30, 45, 90), (0, 45)),
    TRACKERS,
    tuple(NAIVE),
    "wrong, unflagged",
    "%",
    100 * LIMIT_SHARE,
    measure,
    notes=("markers are 36.3 px apart: beyond half of that, the nearest marker is another one",),
)
study = partial(StabilityStudy, MAP)
