"""What is known of the grip in a cycle."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class GripEstimate:
    """The grip at the time of a frame.

    `touch_m` is the aperture at touch, `squeeze_m` by how much the fingers are closed beyond it. `load_n` is the load a
    finger, force and torque together, NaN while it is not known, and `load_n_s` its rate. `slips` is the probability
    that the object slides, `speed_m_s` how fast the estimator says it does.
    """

    t_ns: int
    touch_m: float
    squeeze_m: float
    load_n: float
    load_n_s: float
    slips: float
    speed_m_s: float
