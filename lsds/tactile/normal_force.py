"""Normal force of a finger, from the imprint of an object that does not cover the pad.

The overlap volume V of gel and object and the contact area A determine it, from a ball to a cylinder:

    N = c A^0.58 V^0.75

The constants were fitted on 14 objects in three simulated gels. In leave-one-out validation the error is 8 % RMS, and
35 % for small balls at a light touch. There is no estimate for soft objects, nor for flat faces that cover the pad and
so leave no imprint.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds.contracts import ContactPatch

FORCE_SCALE = 3.82e8
"""Factor c, for areas in m^2, volumes in m^3, forces in N and the modulus of a GelSight Mini's gel; fitted."""
AREA_EXPONENT = 0.583
"""Exponent of the contact area; fitted."""
VOLUME_EXPONENT = 0.748
"""Exponent of the overlap volume; fitted."""
STD_SHARE = 0.15
"""Relative standard deviation of the estimate."""
LEAST_PRESSED_SHARE = 0.03
"""Minimum share of the pad in contact; a smaller contact has no estimate."""
SMALL_SHARE = 0.05
"""Share of the pad below which a deep contact is that of a soft object and has no estimate."""
DEEP_M = 2.5e-4
"""Mean depth above which a contact is deep, m."""


def normal_force_of(contact: ContactPatch | None, pad_m2: float) -> tuple[float, float] | None:
    """Return normal force and one sigma (N) from the contact patch on a pad of `pad_m2`; None without an estimate."""
    if contact is None or contact.area_fraction < LEAST_PRESSED_SHARE:
        return None
    area_m2, volume_m3 = contact.area_fraction * pad_m2, float(contact.depth_m.clip(min=0.0).mean()) * pad_m2
    if contact.area_fraction < SMALL_SHARE and volume_m3 > DEEP_M * area_m2:
        return None
    force_n = FORCE_SCALE * area_m2**AREA_EXPONENT * volume_m3**VOLUME_EXPONENT
    return force_n, STD_SHARE * force_n
