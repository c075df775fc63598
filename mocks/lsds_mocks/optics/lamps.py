"""Direction of the light for each colour and pixel, from two public measurements of one sensor.

The mean change of colour with slope gives each lamp's inclination; the background's fall-off across the image gives its
distance. For a point lamp at height H over the gel and lateral position p, the brightness of a flat gel at s is
proportional to ((p - s)^2 + H^2)^(-3/2), and a slope g changes it by the factor 1 + g (s - p) / H (Lambert 1760).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.optics.background import AMBIENT, GRID_RGB
from lsds_mocks.optics.pad import HEIGHT_PX, WIDTH_PX

if TYPE_CHECKING:
    from numpy.typing import NDArray

SLOPE_TO_RGB = np.array([[-14.0, -88.0], [84.0, 9.0], [11.0, 62.0]])
"""Grey levels of R, G, B per unit slope of the depth (into the gel, towards the lamps) along x and y (down): one matrix
for the whole image, measured on one GelSight Mini with R2 0.71-0.92."""
_PRESSED_SHARE = 0.75
"""Central part of each side in which balls are pressed for such a measurement."""
_SIZE_MM = (0.0625 * WIDTH_PX, 0.0625 * HEIGHT_PX)
_FAR_MM = 200.0
"""Distance beyond which a lamp's direction is the same everywhere on the gel."""


@dataclass(frozen=True, eq=False)
class Lamps:
    """Relative change of brightness per unit slope along `x` and `y`: (H, W, 3) for R, G, B at each pixel."""

    x: NDArray[np.float32]
    y: NDArray[np.float32]


def lamps(directed: NDArray[np.float32]) -> Lamps:
    """Return the lamps that have the measured mean effect on a gel with this directed light (H, W, 3) in levels."""
    rows, columns = directed.shape[:2]
    beside_x, beside_y = (round(n * (1 - _PRESSED_SHARE) / 2) for n in (columns, rows))
    pressed = np.s_[beside_y : rows - beside_y, beside_x : columns - beside_x]
    x_mm = _SIZE_MM[0] * ((np.arange(columns) + 0.5) / columns - 0.5)
    y_mm = _SIZE_MM[1] * ((np.arange(rows) + 0.5) / rows - 0.5)
    lean_x, lean_y = np.empty((2, rows, columns, 3), np.float32)
    for channel, (per_x, per_y) in enumerate(SLOPE_TO_RGB):
        height = lamp_height_mm(channel)
        level = directed[..., channel].astype(np.float64)
        for out, per, place in ((lean_x, per_x, x_mm[None, :]), (lean_y, per_y, y_mm[:, None])):
            near = np.broadcast_to(place / height, level.shape)
            out[..., channel] = near + (per - (level * near)[pressed].mean()) / level[pressed].mean()
    return Lamps(lean_x, lean_y)


def lamp_height_mm(channel: int) -> float:
    """Return a lamp's height (mm) over the gel, from the fall-off along the axis of its greatest inclination.

    D = p / H is known from the slopes. With q the 2/3 power of the brightness at distance d towards the lamp over that
    at d away from it, H solves (q - 1) ((1 + D^2) H^2 + d^2) = 2 (q + 1) D d H.
    """
    levels = GRID_RGB[..., channel] - AMBIENT
    towards = -SLOPE_TO_RGB[channel] / levels.mean()
    axis = int(np.argmax(np.abs(towards)))
    lean, d = abs(float(towards[axis])), _SIZE_MM[axis] / 3
    low, _, high = levels.mean(axis=axis)
    q = float(high / low if towards[axis] > 0 else low / high) ** (2 / 3)
    square, linear, constant = (q - 1) * (1 + lean**2), -2 * (q + 1) * lean * d, (q - 1) * d**2
    if q <= 1 or linear**2 <= 4 * square * constant:
        return _FAR_MM
    found: float = (-linear + math.sqrt(linear**2 - 4 * square * constant)) / (2 * square)
    return min(found, _FAR_MM)
