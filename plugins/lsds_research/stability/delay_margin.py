"""Delay margin of the linear loop of the controller `pd` on a sliding object.

An object of mass m that slides between two fingers obeys m dv/dt = m g - 2 mu N. A finger of stiffness k, with the gel
in series, changes N by k / 2 for a change x of the aperture. The paper's law closes by (kp + kd T_n s) v per frame
interval T, which is a rate of the aperture. The open loop from slip speed to slip speed is therefore

    L(s) = (mu k / m) (kp + kd T_n s) / (T s^2)

a double integrator with a zero. Its phase margin is that of the zero alone, and the delay margin, the phase margin over
the crossover frequency, is close to kd T_n / kp at every gain below 1 / (kd T_n / kp).
"""

from __future__ import annotations

import math
from typing import Any

from lsds_plugins.controllers.pd import NOMINAL_DT_S, PAPER_TICK_M, PdOptions

from lsds.support.extras import require

PIPE_KG = 0.3
"""Mass of the pipe (`cell.simulated.mass_kg`)."""
PIPE_KINETIC = 0.45
"""Kinetic friction of the pipe (`cell.simulated.kinetic_friction`)."""
STIFFNESS_N_M = 4000.0
"""Stiffness of a finger with its gel, N/m: 5 N/mm of the holder in series with some 20 N/mm of the pressed gel."""
LOOP_FRAME_S = 0.04
"""Frame interval of the simulated fingertip, s."""
CM = 100.0
"""Centimetres in a metre: the gains are in ticks per cm/s."""


def delay_margin_s(gain: float = 1.0) -> float:
    """Return the delay (s) at which the linear loop becomes unstable, with `gain` times the paper's gains.

    Raises MissingExtra without python-control.
    """
    require("control", extra="search", purpose="a delay margin")
    import control

    law = PdOptions()
    kp, kd = (gain * CM * PAPER_TICK_M * own for own in (law.kp, law.kd * NOMINAL_DT_S))
    loop: Any = control.tf([kd, kp], [1.0, 0.0, 0.0])
    loop *= PIPE_KINETIC * STIFFNESS_N_M / (PIPE_KG * LOOP_FRAME_S)
    _, phase_deg, _, crossover_rad_s = control.margin(loop)
    return float(math.radians(phase_deg) / crossover_rad_s)
