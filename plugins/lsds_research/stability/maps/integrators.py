"""Integrators of dry friction: error of the drop when a grip is lost for a moment."""

from __future__ import annotations

from functools import lru_cache, partial

from lsds_research.stability.grid import Axis, StabilityMap
from lsds_research.stability.integrators import IN_PRODUCT, SCHEMES, Setting, drop, return_map
from lsds_research.stability.study import StabilityStudy

LIMIT_MM = 2.0
"""Accepted error of the drop (mm)."""
EXACT_S = 2e-5
"""Step of the reference solution (s)."""


@lru_cache(maxsize=16)
def _exact_m(stiffness_n_m: float) -> float:
    return drop(return_map(1.0), Setting(stiffness_n_m=stiffness_n_m), EXACT_S)


def measure(method: str, step_ms: float, stiffness_n_mm: float, seed: int) -> float:
    """Return the error of the drop in mm."""
    del seed  # The drop is deterministic.
    setting = Setting(stiffness_n_m=stiffness_n_mm * 1e3)
    fallen = drop(SCHEMES[method], setting, step_ms * 1e-3)
    return abs(fallen - _exact_m(setting.stiffness_n_m)) * 1e3


MAP = StabilityMap(
    "integrators",
    "Integrators of dry friction: error of a drop when a grip is lost and regained",
    Axis("step", "ms", (0.25, 0.5, 1, 2, 4, 8, 16, 32), (0.5, 2, 8, 32), (2, 8), log=True),
    Axis("stiffness", "N/mm", (0.5, 1, 2, 4, 8, 16, 32, 64), (1, 4, 16, 64), (2, 16), log=True),
    IN_PRODUCT,
    tuple(name for name in SCHEMES if name not in IN_PRODUCT),
    "error of the drop",
    "mm",
    LIMIT_MM,
    measure,
    {"full": 1, "quick": 1, "check": 1},
    ("the plant's step is 2 ms, its gels are of 2 to 16 N/mm",),
)
study = partial(StabilityStudy, MAP)
