"""Where a pad's elements end: two to a hat, thin ones at the walls and at the base, all lengths in thicknesses.

Where a free wall meets the bonded base, stress is singular, and near Poisson's ratio 1/2 motion under pressure beside a
wall hangs on it: with a lowest layer of a quarter thickness it is off by 1 to 4 %, with `FINE` by 0.2 %. Loads at
the surface need thin elements less, since the layer is subtracted as the same elements see it: what they do not resolve
there cancels. Figures are in docs/decisions/0012-the-pad-correction.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

PER_HAT = 2
"""Elements along a hat interval. Hats have their kinks at elements' edges."""


@dataclass(frozen=True, slots=True)
class Mesh:
    """`layers`: heights of the elements from the surface to the base, in any unit. `wall`: parts into which the last
    element before a wall is cut, from the inside to the wall, in any unit."""

    layers: tuple[float, ...]
    wall: tuple[float, ...]


FINE = Mesh((0.2, 0.45, 0.8, 1.05, 0.9, 0.42, 0.14, 0.04), (1.0, 0.35, 0.12))
"""Of shipped corrections."""
COARSE = Mesh((0.3, 0.5, 0.2), (1.0,))
"""Of trials: within some per cent."""


def depth(mesh: Mesh) -> NDArray[np.float64]:
    """Return edges from the surface, 0, to the base, 1."""
    return _parts(mesh.layers)


def half_pad(mesh: Mesh, hats: int, pitch: float) -> NDArray[np.float64]:
    """Return edges from the middle, 0, to the wall of a pad of `hats` intervals, whether even or odd."""
    whole = np.arange(hats) * (pitch / PER_HAT)
    return np.asarray(np.concatenate([whole, whole[-1] + _parts(mesh.wall)[1:] * (pitch / PER_HAT)]), np.float64)


def interval(pitch: float) -> NDArray[np.float64]:
    """Return edges of the elements of one hat interval of the layer."""
    return np.linspace(0.0, pitch, PER_HAT + 1)


def _parts(sizes: tuple[float, ...]) -> NDArray[np.float64]:
    return np.asarray(np.concatenate([[0.0], np.cumsum(sizes)]) / np.sum(sizes))
