"""Force and torque combined into an equivalent force, and slip and rotation into an equivalent speed.

A soft finger holds a force F and a torque M about its normal while (F / F0)^2 + (M / (c F0))^2 < 1, with the friction
limit F0 of a pure force (Howe and Cutkosky's ellipse for the limit surface). So sqrt(F^2 + (M / c)^2) replaces the
force, and v + c |w| the speed. The arm c follows from the pressure distribution: 0.59 a for a round contact of radius
a, L / 4 for a line. One value serves all objects: that of a pipe or a plank (5.2 mm when these turn in the simulated
grip). An error of c weights force and torque wrongly, but cancels if the same load slips again.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds.contracts import ContactLoad, SlipEstimate

FRICTION_ARM_M = 5e-3
"""Arm c of friction against turning."""


def pull_of(load: ContactLoad) -> float:
    """Return the equivalent force (N): the pure force that is equally near to the friction limit."""
    return math.hypot(load.force_n, load.torque_nm / FRICTION_ARM_M)


def speed_of(estimate: SlipEstimate) -> tuple[float, float]:
    """Return the equivalent slip speed, rotation included, and one sigma (m/s); NaN if the estimator abstains."""
    speed, std = estimate.speed_m_s, estimate.speed_std_m_s
    if math.isfinite(estimate.angular_rad_s):
        speed += FRICTION_ARM_M * abs(estimate.angular_rad_s)
    if math.isfinite(estimate.angular_std_rad_s):
        std = math.hypot(std, FRICTION_ARM_M * estimate.angular_std_rad_s)
    return speed, std
