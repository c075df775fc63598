"""Start of the registration after a leap of the imprint: its best match over all places and several turns.

Gradients lead no further than the width of an edge. If that is not enough, the whole imprint is searched for
(normalised cross-correlation, Lewis 1995).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from lsds.tactile.imprint.layers import Layer
    from lsds.tactile.imprint.relief import Plane

#: Turns that are tried, rad: up to 40 degrees per frame, close enough for the registration to reach those between.
TURNS = tuple(math.radians(turn) for turn in range(-40, 41, 8))
#: Half-width of the template in radii of gyration.
_RADII = 1.4
#: Minimum half-width of the template, px; chosen.
_LEAST_HALF_PX = 8
#: Maximum half-width of the template, px; chosen to bound the time of a search.
_MOST_HALF_PX = 16
#: Energy that is added to each place, as a share of the imprint's: it suppresses chance matches of few pixels.
_ADDED_ENERGY_SHARE = 0.3
#: Energy that keeps a division by zero out of an empty template; chosen.
_TINY = 1e-9


def leapt(
    first: Layer, second: Layer, centre: tuple[float, float], radius: float, gel: tuple[float, float]
) -> tuple[float, float, float]:
    """Return the imprint's most likely motion against the gel: x, y (relief px) and turn (rad).

    `centre`, `radius` and `gel` (motion of the gel) are in relief px.
    """
    step = first.step
    x, y = centre[0] / step, centre[1] / step
    half = int(min(max(_RADII * radius / step, _LEAST_HALF_PX), _MOST_HALF_PX))
    shown, image = first.curvature * first.weight, second.curvature * second.weight
    size = 2 * half + 1
    # A border of zeros lets the imprint's centre come close to the edge of the image.
    around = cv2.copyMakeBorder(image, half, half, half, half, cv2.BORDER_CONSTANT, value=0.0)
    energy = cv2.sqrBoxFilter(image, cv2.CV_32F, (size, size), normalize=False, borderType=cv2.BORDER_CONSTANT)
    whole = cv2.norm(_turned(shown, x, y, 0.0, half, size), cv2.NORM_L2SQR)
    # A few pixels at the edge may match by chance: a place with little energy gets a low match.
    scale = np.float32(1) / np.sqrt(np.maximum(energy, 0) + np.float32(_ADDED_ENERGY_SHARE * whole + _TINY))
    best = (-math.inf, 0.0, 0.0, 0.0)
    for turn in TURNS:
        template = _turned(shown, x, y, turn, half, size)
        found = cv2.matchTemplate(around, template, cv2.TM_CCORR)
        _, match, _, (at_x, at_y) = cv2.minMaxLoc(cv2.multiply(found, scale, dst=found))
        match /= math.sqrt(cv2.norm(template, cv2.NORM_L2SQR) + _TINY)
        if match > best[0]:
            best = (match, (at_x - x) * step - gel[0], (at_y - y) * step - gel[1], turn)
    return best[1:]


def _turned(shown: Plane, x: float, y: float, turn: float, half: int, size: int) -> Plane:
    """Return the square around (x, y), turned clockwise about it."""
    cos, sin = math.cos(turn), math.sin(turn)
    back = np.array([[cos, sin, x - cos * half - sin * half], [-sin, cos, y + sin * half - cos * half]])
    turned = cv2.warpAffine(shown, back, (size, size), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
    return np.asarray(turned, np.float32)
