"""Lifts: delay of the gripper against the margin of the law, or the gain of the PD controller."""

from __future__ import annotations

from functools import partial

from lsds_research.stability.grid import Axis, StabilityMap
from lsds_research.stability.maps.lifts import CONTROLLERS, FIXED, SLIP_LIMIT_MM, lifted, slip_mm
from lsds_research.stability.study import StabilityStudy

PD_GAIN = 3.1
"""Proportional gain of the PD controller at the default margin of the belief, ticks per cm/s: that of the paper."""
DEFAULT_MARGIN = 1.2
"""Default margin of the belief."""


def measure(method: str, delay_ms: float, margin: float, seed: int) -> float:
    """Return the slip of the pipe (mm)."""
    settings: dict[str, float] = {"gripper.mock-hand-e.latency_ms": delay_ms}
    if method == "belief":
        settings["controller.belief.margin"] = margin
    elif method == "pd":
        settings["controller.pd.kp"] = PD_GAIN * margin / DEFAULT_MARGIN
    return slip_mm(lifted(method, seed, settings))


MAP = StabilityMap(
    "loop-delay",
    "Lift of the pipe: slip by delay of the gripper and margin (belief), or gain in units of default / 1.2 (pd)",
    Axis("delay of the gripper", "ms", (20, 40, 80, 120, 160, 200, 300, 400), (40, 120, 300), (40, 200)),
    Axis("margin", "", (1.05, 1.2, 1.35, 1.5, 1.8), (1.2, 1.5), (1.2,)),
    CONTROLLERS,
    (FIXED,),
    "slip",
    "mm",
    SLIP_LIMIT_MM,
    measure,
)
study = partial(StabilityStudy, MAP)
