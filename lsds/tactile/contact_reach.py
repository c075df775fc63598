"""Reach of a contact along the load: how far a round object can slip before it leaves its contact.

An object that slips carries its contact along. Between flat or straight surfaces the contact stays as large as it is. A
sphere that slips by the radius of its contact lies next to its dent, and the fingers squeeze it out, whatever their
force. So slip is measured against the half-length of the contact in the direction of the load.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lsds.contracts import ContactPatch
    from lsds.contracts.values import Vector2


def reach_of(contact: ContactPatch | None, along: Vector2) -> float:
    """Return the half-length (m) of a contact along a direction: twice the RMS distance of its pixels from their mean.

    This is the radius of a disc. NaN without contact, without a direction, or if the size of a pixel is not known.
    """
    length = math.hypot(*along)
    if contact is None or not length > 0:
        return math.nan
    row, column = np.nonzero(contact.depth_m > contact.threshold_m)
    if not len(row):
        return math.nan
    at = (along[0] * column + along[1] * row) * (contact.pitch_m / length)
    return 2 * float(at.std())
