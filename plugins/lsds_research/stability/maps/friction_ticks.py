"""Lifts: static over kinetic friction against the tick of the gripper."""

from __future__ import annotations

import math
from functools import partial

from lsds.clock import NS_PER_S
from lsds_research.stability.grid import Axis, StabilityMap
from lsds_research.stability.maps.lifts import CONTROLLERS, FIXED, GRIP_LIMIT, lifted, peak
from lsds_research.stability.study import StabilityStudy
from lsds_research.studies.grip.lift import LATE_NS

STATIC = 0.55
"""Static friction of the lifted object, that of the catalogue's PVC pipe."""
OPEN_TICK = 3
"""Position register of the open simulated gripper, ticks."""
STROKE_MM = 50.0
"""Stroke of the simulated gripper, mm: that of a Hand-E."""
LIMIT_CYCLE = 2
"""Reversals of the fingers late in a hold (`LATE_NS`) that make a limit cycle: close, open, close."""


def measure(method: str, ratio: float, tick_mm: float, seed: int) -> float:
    """Return the greatest normal force over the needed one, in a hold of 10 s; infinity for a limit cycle."""
    settings = {
        "task.hold_s": 10.0,
        "cell.simulated.static_friction": STATIC,
        "cell.simulated.kinetic_friction": round(STATIC / ratio, 4),
        "gripper.mock-hand-e.closed_tick": OPEN_TICK + round(STROKE_MM / tick_mm),
    }
    found = lifted(method, seed, settings)
    return math.inf if found["late_reversals"] >= LIMIT_CYCLE else peak(found)


MAP = StabilityMap(
    "friction-ticks",
    "Hold of the pipe for 10 s: grip over the needed one by friction ratio and tick",
    Axis("static over kinetic friction", "", (1.0, 1.2, 1.5, 2.0, 2.5), (1.0, 1.5, 2.0), (1.2, 2.0)),
    Axis("tick", "mm", (0.2, 0.4, 0.6, 0.8, 1.0), (0.2, 0.6), (0.2,)),
    CONTROLLERS,
    (FIXED,),
    "peak over needed",
    "",
    GRIP_LIMIT,
    measure,
    notes=(f"{LIMIT_CYCLE} reversals of the fingers in the last {LATE_NS // NS_PER_S} s, a limit cycle, do not pass",),
)
study = partial(StabilityStudy, MAP)
