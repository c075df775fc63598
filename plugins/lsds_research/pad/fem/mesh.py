"""Where a pad's elements end: two to a hat, thin ones at the walls and at the base, all lengths in thicknesses.

Stress is singular at the edge between a free wall and the bonded base. Near Poisson's ratio 1/2 this singularity
affects motion under pressure close to a wall: the error is 1 to 4 % with a lowest layer of a quarter thickness, and
0.2 % with `FINE`. Loads at the surface need fewer thin elements: the layer is subtracted with the same elements, so
errors there cancel. Figures are in docs/decisions/0012-the-pad-correction.md.
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
"""Mesh of quick trials, with errors of some per cent."""


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
