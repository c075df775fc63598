"""Force and torque together: how near a contact is to sliding or turning, and how fast it does either.

A soft finger holds a force F and a torque M about its normal as long as (F / F0)^2 + (M / (c F0))^2 < 1, F0 being what
friction holds of a force alone (Howe and Cutkosky's ellipse for the limit surface). So sqrt(F^2 + (M / c)^2) takes the
place of the force, and v + c |w| that of the speed. The arm c is that of the pressure's spread: 0.59 a for a round
contact of radius a, L / 4 for a line. The one for all here is that of a pipe or a plank (5.2 mm where these turn in the
simulated grip); a wrong one weighs force against torque wrongly, and cancels where the same load slips again.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds.contracts import ContactLoad, SlipEstimate

ARM_M = 5e-3
"""Arm c of friction against turning."""


def pull_of(load: ContactLoad) -> float:
    """Return the force (N) that alone would be as near to the limit of friction."""
    return math.hypot(load.force_n, load.torque_nm / ARM_M)


def speed_of(estimate: SlipEstimate) -> tuple[float, float]:
    """Return how fast the contact slips, turning included, and one sigma (m/s); NaN where the estimator abstains."""
    speed, std = estimate.speed_m_s, estimate.speed_std_m_s
    if math.isfinite(estimate.angular_rad_s):
        speed += ARM_M * abs(estimate.angular_rad_s)
    if math.isfinite(estimate.angular_std_rad_s):
        std = math.hypot(std, ARM_M * estimate.angular_std_rad_s)
    return speed, std
