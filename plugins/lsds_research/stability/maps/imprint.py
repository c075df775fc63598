"""A flat object that slides: slip frames that are not found and false alarms, by depth of its texture and speed."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from lsds_research.stability.grid import Axis, StabilityMap
from lsds_research.stability.maps.moving_object import judged_frames
from lsds_research.stability.maps.turning import CELL
from lsds_research.stability.study import StabilityStudy

STICKING = 0.5
"""Sticking part of the contact above which an alarm is false; below, slip may be seen to begin."""


def measure(method: str, depth_um: float, speed_mm_s: float, seed: int) -> float:
    """Return the share of slip frames that a detector does not find, or of sticking ones that it calls slip (%), the
    greater of the two."""
    cell = CELL | {"texture_depth_mm": depth_um * 1e-3, "grain_um": 0.0}
    if not depth_um:
        cell["texture"] = "smooth"
    frames = judged_frames(cell, detector=method, estimator="field", velocity_m_s=speed_mm_s * 1e-3, seed=seed)
    missed = [not each.detection.slip for each in frames if each.slips]
    false = [bool(each.detection.slip) for each in frames if each.truth.stick_ratio > STICKING]
    return 100 * float(max(np.mean(missed), np.mean(false or [False]))) if missed else math.inf


MAP = StabilityMap(
    "imprint",
    "Flat object that slides: slip frames not found, or false alarms before",
    Axis("depth of the texture", "um", (0, 5, 10, 20, 50, 100), (0, 10, 50), (10, 50)),
    Axis("speed", "mm/s", (2, 5, 10, 20, 40, 80), (5, 20, 80), (10,)),
    ("fused", "imprint"),
    ("rigid-residual", "threshold"),
    "wrong frames",
    "%",
    25.0,
    measure,
    notes=("at 25 Hz; markers alone rest while an object without edges in view slides over them",),
)
study = partial(StabilityStudy, MAP)
