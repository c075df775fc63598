"""Normal force of a finger, from the imprint of an object that does not cover the pad.

The overlap volume V of gel and object and the contact area A tell it together, from a ball to a cylinder:

    N = c A^0.58 V^0.75

fitted on 14 objects in three simulated gels; left out in turn, an object is off by 8 % RMS, small balls at a light
touch by 35 %. A flat face that covers the pad leaves no imprint: nothing is told of it, nor of a soft one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds.contracts import ContactPatch

SCALE, OF_AREA, OF_VOLUME = 3.82e8, 0.583, 0.748
"""c and the exponents, for areas in m^2, volumes in m^3 and the modulus of a GelSight Mini's gel."""
STD_SHARE = 0.15
"""Relative standard deviation."""
LEAST_SHARE, SMALL_SHARE, DEEP_M = 0.03, 0.05, 2.5e-4
"""A contact on a smaller share of the pad than the first is none that this can tell of; one on less than the second
that is deeper than the third on average is what a soft object shows of itself."""


def normal_force_of(contact: ContactPatch | None, pad_m2: float) -> tuple[float, float] | None:
    """Return normal force and one sigma (N), from the contact patch on a pad of an area; None where it tells none."""
    if contact is None or contact.area_fraction < LEAST_SHARE:
        return None
    area_m2, volume_m3 = contact.area_fraction * pad_m2, float(contact.depth_m.clip(min=0.0).mean()) * pad_m2
    if contact.area_fraction < SMALL_SHARE and volume_m3 > DEEP_M * area_m2:
        return None
    force_n = SCALE * area_m2**OF_AREA * volume_m3**OF_VOLUME
    return force_n, STD_SHARE * force_n
