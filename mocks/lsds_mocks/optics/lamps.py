"""Where the light comes from: a direction for each colour and pixel, from two public measurements of one sensor.

The mean colour against slope says how far each lamp leans, and the background's fall-off across the image how near it
is. For a point lamp at height H over the gel and p to its side, a flat gel's brightness at s goes with
((p - s)^2 + H^2)^(-3/2), and a slope g changes it by the factor 1 + g (s - p) / H (Lambert 1760).
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
_PRESSED = 0.75
"""Part of each side, about the middle, in which balls are pressed for such a measurement."""
_SIZE_MM = (0.0625 * WIDTH_PX, 0.0625 * HEIGHT_PX)
_FAR_MM = 200.0
"""Beyond, a lamp's direction is the same all over the gel."""


@dataclass(frozen=True, eq=False)
class Lamps:
    """Relative change of brightness per unit slope along `x` and `y`: (H, W, 3) for R, G, B at each pixel."""

    x: NDArray[np.float32]
    y: NDArray[np.float32]


def lamps(directed: NDArray[np.float32]) -> Lamps:
    """Return the lamps whose mean effect, on a gel of this directed light (H, W, 3) in levels, is the measured one."""
    rows, columns = directed.shape[:2]
    beside_x, beside_y = (round(n * (1 - _PRESSED) / 2) for n in (columns, rows))
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
    """Return a lamp's height over the gel, from the fall-off along the axis it leans to most.

    With D = p / H from the slopes, and q the ratio of brightness at d towards the lamp and at d away from it, to the
    power of 2/3: (q - 1) ((1 + D^2) H^2 + d^2) = 2 (q + 1) D d H.
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
