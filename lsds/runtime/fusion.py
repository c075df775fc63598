"""Fusion of several fingers: one detection and one estimate of the object, in the plane of the first finger.

Fingers face each other: motion to the right for one is motion to the left for the opposite one, and rotations are
reversed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from lsds.contracts import Detection, SlipEstimate

if TYPE_CHECKING:
    from lsds.contracts import FingerCycle

#: Lower bound of standard deviations, so that no finger gets infinite weight, m/s and rad/s.
LEAST_FUSED_STD = 1e-6


def fused_detection(fingers: Sequence[FingerCycle]) -> Detection:
    """Return slip if any finger detects it, because a slipping finger no longer holds; otherwise no slip.

    The confidence is that of the most confident finger. If all fingers abstain, the result abstains.
    """
    if len(fingers) == 1:
        return fingers[0].detection
    detections = [finger.detection for finger in fingers]
    slips = [detection for detection in detections if detection.slip]
    holds = [detection for detection in detections if detection.slip is False]
    if slips:
        return max(slips, key=lambda detection: detection.confidence)
    # "No slip" is only as reliable as the least confident finger.
    return min(holds, key=lambda detection: detection.confidence) if holds else detections[0]


def fused_estimate(fingers: Sequence[FingerCycle]) -> SlipEstimate:
    """Return the mean of all fingers that do not abstain, weighted by its inverse variance (independent errors)."""
    if len(fingers) == 1 and not fingers[0].opposite:
        return fingers[0].estimate
    estimates = [
        (-1.0 if finger.opposite else 1.0, finger.estimate) for finger in fingers if not finger.estimate.abstained
    ]
    if not estimates:
        return fingers[0].estimate
    if len(estimates) == 1 and estimates[0][0] > 0:
        return estimates[0][1]
    x, x_std = _weighted([(sign * e.velocity_m_s[0], e.velocity_std_m_s[0]) for sign, e in estimates])
    y, y_std = _weighted([(e.velocity_m_s[1], e.velocity_std_m_s[1]) for _, e in estimates])
    turn, turn_std = _weighted([(sign * e.angular_rad_s, e.angular_std_rad_s) for sign, e in estimates])
    speed, speed_std = _weighted([(e.speed_m_s, e.speed_std_m_s) for _, e in estimates])
    return SlipEstimate((x, y), (x_std, y_std), turn, turn_std, speed, speed_std)


def _weighted(values: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return the inverse-variance mean of (value, standard deviation) pairs, and its standard deviation."""
    weights = [1.0 / max(std, LEAST_FUSED_STD) ** 2 for _, std in values]
    total = sum(weights)
    mean = sum(weight * value for weight, (value, _) in zip(weights, values, strict=True)) / total
    return mean, math.sqrt(1.0 / total)
