"""Lifts: false alarms of the detector against the first squeeze."""

from __future__ import annotations

from functools import partial

from lsds_research.stability.grid import Axis, StabilityMap
from lsds_research.stability.maps.lifts import CONTROLLERS, FIXED, GRIP_LIMIT, lifted, peak
from lsds_research.stability.study import StabilityStudy


def measure(method: str, severity: float, squeeze_mm: float, seed: int) -> float:
    """Return the greatest normal force over the needed one, in a hold of 20 s."""
    settings: dict[str, object] = {"task.hold_s": 20.0}
    if severity:
        settings["faults"] = [{"backend": "detector-alarms", "severity": int(severity), "at": "lift"}]
    return peak(lifted(method, seed, settings, squeeze_mm=squeeze_mm))


MAP = StabilityMap(
    "false-alarms",
    "Hold of the pipe for 20 s: grip over the needed one by false alarms and first squeeze",
    Axis("severity of false alarms", "", (0, 1, 2, 3, 4, 5), (0, 3, 5), (0, 5)),
    Axis("first squeeze", "mm", (0.7, 1.1, 1.5, 1.9), (1.1,), (1.1,)),
    CONTROLLERS,
    (FIXED,),
    "peak over needed",
    "",
    GRIP_LIMIT,
    measure,
    notes=("severity 5 calls every frame slip; 0 is the detector without a fault",),
)
study = partial(StabilityStudy, MAP)
