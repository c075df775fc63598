"""Rules that every plant shares: how fast the contact slides, when it slips, and when an object is dropped."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lsds_mocks.gel.protocol import GelModel

STILL_STICKS = 0.1
"""Greatest sticking part of the contact that still counts as gross slip: while a rough or porous surface slides, a cell
or two may stick briefly at any time."""


def slips(gel: GelModel, normal_n: float) -> bool:
    """Return whether a contact under a normal force is in gross slip."""
    return normal_n > 0 and gel.stick_ratio <= STILL_STICKS


def radius_of_gyration_m(points_m: NDArray[np.float64]) -> float:
    """Return the radius of gyration (m) of points (2, N) about their centre; 0 without points."""
    x, y = points_m
    return math.sqrt(float(x.var() + y.var())) if x.size else 0.0


def sliding_speed_m_s(x_m_s: float, y_m_s: float, turn_rad_s: float, radius_m: float) -> float:
    """Return the mean speed (m/s) of a patch against the object; rotation counts at the radius of gyration."""
    return math.hypot(x_m_s, y_m_s, turn_rad_s * radius_m)


def drops(normal_n: float, supported: bool, slipped_m: float, most_slip_m: float) -> bool:
    """Return whether an object is dropped: nothing holds it, or it has slipped too far."""
    return not (normal_n > 0 or supported) or slipped_m > most_slip_m
