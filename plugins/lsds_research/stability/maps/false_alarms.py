"""Lifts: false alarms of the detector against the time that the object is held, over which the grip may creep."""

from __future__ import annotations

from functools import partial

from lsds_mocks.faults.catalogue import FAULT_SHARES

from lsds_research.stability.grid import Axis, StabilityMap
from lsds_research.stability.maps.lifts import CONTROLLERS, FIXED, GRIP_LIMIT, lifted, peak
from lsds_research.stability.study import StabilityStudy

SEVERITIES = {round(100 * share): number for number, share in enumerate((0.0, *FAULT_SHARES))}
"""Severity of the fault `detector-alarms` by the share of frames that it calls slip, %."""


def measure(method: str, alarms_percent: float, hold_s: float, seed: int) -> float:
    """Return the greatest normal force over the needed one."""
    settings: dict[str, object] = {"task.hold_s": hold_s}
    if alarms_percent:
        severity = SEVERITIES[int(alarms_percent)]
        settings["faults"] = [{"backend": "detector-alarms", "severity": severity, "at": "lift"}]
    return peak(lifted(method, seed, settings))


MAP = StabilityMap(
    "false-alarms",
    "Hold of the pipe: grip over the needed one by false alarms and time",
    Axis("frames called slip", "%", tuple(SEVERITIES), (0, 20, 100), (0, 100)),
    Axis("hold", "s", (5, 20, 60), (20,), (20,)),
    CONTROLLERS,
    (FIXED,),
    "peak over needed",
    "",
    GRIP_LIMIT,
    measure,
    notes=("the alarms begin with the lift; 0 % is the detector without a fault",),
)
study = partial(StabilityStudy, MAP)
