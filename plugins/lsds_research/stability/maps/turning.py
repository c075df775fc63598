"""An object that turns under the finger: error of the estimated rate, by rate and frame interval."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from lsds_research.stability.grid import Axis, StabilityMap
from lsds_research.stability.maps.moving_object import judged_frames
from lsds_research.stability.study import StabilityStudy

CELL = {
    "shape": "box",
    "diameter_mm": 30.0,
    "width_mm": 60.0,
    "length_mm": 100.0,
    "grip_height_mm": 50.0,
    "texture": "bumps",
    "texture_depth_mm": 0.1,
    "fidelity": "pad",
    "grid": 1,
}
"""A flat box with bumps; its faces cover the pad."""


def measure(method: str, rate_rad_s: float, interval_ms: float, seed: int) -> float:
    """Return the median error of the rate of turning slip (%); a frame without an answer counts as 100 %."""
    frames = judged_frames(
        CELL, detector="fused", estimator=method, turn_rad_s=rate_rad_s, interval_s=interval_ms * 1e-3, seed=seed
    )
    errors = [
        1.0
        if each.estimate.abstained or not math.isfinite(each.estimate.angular_rad_s)
        else abs(each.estimate.angular_rad_s - each.truth.slip_angular_rad_s) / abs(each.truth.slip_angular_rad_s)
        for each in frames
        if each.slips
    ]
    return 100 * float(np.median(errors)) if errors else math.inf


MAP = StabilityMap(
    "turning",
    "Object with bumps that turns: median error of the rate",
    Axis("rate", "rad/s", (0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 3.0), (0.2, 1.0, 3.0), (0.5, 1.0)),
    Axis("frame interval", "ms", (15, 25, 40, 60, 80, 120), (25, 40, 80), (40,)),
    ("fused", "imprint"),
    ("field",),
    "error of the rate",
    "%",
    20.0,
    measure,
    notes=("'field' reads only the markers, which stay at rest while an object slides over them",),
)
study = partial(StabilityStudy, MAP)
