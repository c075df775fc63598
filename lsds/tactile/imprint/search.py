"""A start for the registration where the imprint has leapt: the best place of it among all, at several turns.

Gradients lead no further than an edge is wide. Where that was not enough, the imprint is looked for as a whole
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

#: Turns that are tried, rad: to 40 degrees a frame, so close together that the registration reaches what lies between.
TURNS = tuple(math.radians(turn) for turn in range(-40, 41, 8))
#: The imprint is looked for with what lies within this many radii of gyration of its centre, and within these px.
_RADII, _LEAST, _MOST = 1.4, 8, 16
_FAINT, _TINY = 0.3, 1e-9


def leapt(
    first: Layer, second: Layer, centre: tuple[float, float], radius: float, gel: tuple[float, float]
) -> tuple[float, float, float]:
    """Return where the imprint has most likely gone, less the gel's motion: x, y (relief px) and turn (rad).

    `centre`, `radius` and `gel` in relief px.
    """
    step = first.step
    x, y = centre[0] / step, centre[1] / step
    half = int(min(max(_RADII * radius / step, _LEAST), _MOST))
    shown, image = first.curvature * first.weight, second.curvature * second.weight
    size = 2 * half + 1
    # Beyond the image nothing is known: a border lets the imprint's centre come close to the edge.
    around = cv2.copyMakeBorder(image, half, half, half, half, cv2.BORDER_CONSTANT, value=0.0)
    energy = cv2.sqrBoxFilter(image, cv2.CV_32F, (size, size), normalize=False, borderType=cv2.BORDER_CONSTANT)
    whole = cv2.norm(_turned(shown, x, y, 0.0, half, size), cv2.NORM_L2SQR)
    # A few pixels at the edge may match by chance: where little is seen, little is matched.
    scale = np.float32(1) / np.sqrt(np.maximum(energy, 0) + np.float32(_FAINT * whole + _TINY))
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
    """Return what lies around (x, y), turned clockwise about it."""
    cos, sin = math.cos(turn), math.sin(turn)
    back = np.array([[cos, sin, x - cos * half - sin * half], [-sin, cos, y + sin * half - cos * half]])
    turned = cv2.warpAffine(shown, back, (size, size), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
    return np.asarray(turned, np.float32)
