"""The estimate of the grip in a cycle."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, eq=False)
class GripEstimate:
    """The grip at the time of a frame.

    `touch_m` is the aperture at touch, `squeeze_m` by how much the fingers are closed beyond it. `load_n` is the load a
    finger, force and torque together, NaN while it is not known; `load_n_s` its rate, `greatest_n` its maximum of late,
    and `stale` whether a finger does not tell it now. `normal_n` is the normal force by the imprint, NaN if unknown.
    `slips` is the probability that the object slides, `slip_m_s` its speed if it does: that of the arm while the object
    may stand on its support, else at least that of a fall. `required_m(risk, margin, load_n, braking)` returns the
    least squeeze (m) at which `margin` times the load exceeds the friction limit with at most that probability, for an
    object that sticks at no more than `load_n`, or slides at any load, which then counts `braking` times; it answers
    for the newest grip, not for that of `t_ns`. `limit_n` is the friction limit of a finger at that squeeze with its
    standard deviation `limit_std_n`, NaN while no load is known.
    """

    t_ns: int
    touch_m: float
    squeeze_m: float
    load_n: float
    load_n_s: float
    greatest_n: float
    stale: bool
    normal_n: float
    slips: float
    slip_m_s: float
    required_m: Callable[[float, float, float, float], float]
    limit_n: float = math.nan
    limit_std_n: float = math.nan
