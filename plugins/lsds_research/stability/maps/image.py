"""Lifts: blur of the image against a drift of its gain."""

from __future__ import annotations

from functools import partial

from lsds_research.stability.grid import Axis
from lsds_research.stability.maps.lifts import lifted, slip_map, slip_mm
from lsds_research.stability.study import StabilityStudy


def measure(method: str, blur: float, drift: float, seed: int) -> float:
    """Return the slip of the pipe (mm); an image that cannot be used stops the cell, which counts as infinite."""
    faults = [
        {"backend": f"camera-{name}", "severity": int(severity), "at": "lift"}
        for name, severity in (("blur", blur), ("gain", drift))
        if severity
    ]
    return slip_mm(lifted(method, seed, {"faults": faults} if faults else {}))


MAP = slip_map(
    "image",
    "Lift of the pipe: slip by blur and drift of the gain",
    Axis("blur", "severity", (0, 1, 2, 3, 4, 5), (0, 3, 5), (0, 3)),
    Axis("drift of the gain", "severity", (0, 1, 2, 3, 4, 5), (0, 3), (0,)),
    measure,
    notes=("from the beginning of the lift; severities are those of docs/faults.md",),
)
study = partial(StabilityStudy, MAP)
