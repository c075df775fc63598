"""Image of the untouched gel: a smooth function through nine measured colours, with a tint per gel."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.optics.pad import HEIGHT_PX, WIDTH_PX

if TYPE_CHECKING:
    from numpy.typing import NDArray

GRID_RGB = np.array(
    [
        [(48, 111, 110), (61, 128, 135), (43, 109, 115)],
        [(92, 118, 119), (130, 137, 148), (85, 116, 125)],
        [(80, 106, 85), (111, 123, 103), (77, 107, 91)],
    ],
    np.float64,
)
"""Mean colours of the nine thirds of the image on public GelSight Mini recordings, top row first."""
AMBIENT = 25.0
"""Undirected light (levels); without it, red at the upper edge would be half of that in recordings."""
TINT = 0.04
"""Maximum relative difference of a colour channel between gels at a variation of 1; chosen."""


def background(variation: float, rng: np.random.Generator, brightness: float = 1.0) -> NDArray[np.float32]:
    """Return (240, 320, 3) float32 RGB levels: a Gaussian fall-off in x and y through the thirds' centres."""
    tint = brightness * (1 + variation * TINT * rng.uniform(-1, 1, 3))
    return np.asarray(_levels() * tint, np.float32)


@cache
def _levels() -> NDArray[np.float64]:
    """Return the levels (240, 320, 3) without a tint, which are those of every gel."""
    across, down = _quadratic(WIDTH_PX), _quadratic(HEIGHT_PX)
    # A parabola through the levels instead of their logarithms would turn negative at the upper edge.
    return np.asarray(np.exp(np.einsum("yi,xj,ijc->yxc", down, across, np.log(GRID_RGB - AMBIENT))) + AMBIENT)


def _quadratic(size: int) -> NDArray[np.float64]:
    """Lagrange weights (size, 3) of nodes at 1/6, 1/2 and 5/6 of the side."""
    t = ((np.arange(size) + 0.5) / size - 0.5) * 3
    return np.stack([t * (t - 1) / 2, 1 - t * t, t * (t + 1) / 2], axis=1)
