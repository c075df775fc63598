"""Size of a contact patch: along the load, and in its longest direction.

The reach of a contact says how far a round object can slip along the load before it leaves its contact. An object that
slips carries its contact along. Between flat or straight surfaces the contact stays as large as it is. A sphere that
slips by the radius of its contact lies next to its dent, and the fingers squeeze it out, whatever their force. So slip
is measured against the half-length of the contact in the direction of the load.

The longest direction distinguishes round contacts from long and flat ones: those of spheres and corners end within the
pad, those of cylinders and edges cross it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import cv2
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
    x, y = along[0] / length, along[1] / length
    xx, xy, yy = _second_moments(contact)
    return 2 * contact.pitch_m * math.sqrt(max(x * x * xx + 2 * x * y * xy + y * y * yy, 0.0))


def half_length_of(contact: ContactPatch | None) -> float:
    """Return the half-length (m) of a contact in its longest direction; NaN as `reach_of`."""
    if contact is None:
        return math.nan
    xx, xy, yy = _second_moments(contact)
    # The greater eigenvalue of the matrix of second moments.
    return 2 * contact.pitch_m * math.sqrt((xx + yy + math.hypot(xx - yy, 2 * xy)) / 2)


def _second_moments(contact: ContactPatch) -> tuple[float, float, float]:
    """Return xx, xy and yy of the pixels about their mean (px^2); NaN without a pixel in contact."""
    moments = cv2.moments((contact.depth_m > contact.threshold_m).view(np.uint8))
    count = moments["m00"] or math.nan
    return moments["mu20"] / count, moments["mu11"] / count, moments["mu02"] / count
