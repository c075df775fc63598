"""Gel models: error of the markers, by radius of the contact patch and its distance from the pad's wall."""

from __future__ import annotations

from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np
from lsds_mocks.gel.material import GelMaterial
from lsds_mocks.gel.shapes import Moved, Sphere

from lsds_research.stability.grid import Axis, StabilityMap
from lsds_research.stability.study import StabilityStudy
from lsds_research.studies.gel.run_scene import lead
from lsds_research.studies.gel.scenes import Scene

if TYPE_CHECKING:
    from lsds_mocks.gel.protocol import GelModel
    from lsds_mocks.gel.shapes import Shape
    from numpy.typing import NDArray

INDENTATION_M = 0.3e-3
"""Indentation, m."""
WAY_M = 0.5e-3
"""Way of the object along the wall, m."""
FRAMES = 10
"""Number of equal parts of that way."""
FRICTION = 0.6
"""Friction coefficient."""
GRIDS = {"pad, grid 1": 1, "pad, grid 2": 2, "finest": 4}
"""Cells per hat interval; the finest is the reference, and the finest grid of `auto`."""
LIMIT_UM = 5.0
"""Accepted RMS error of the markers, um: the tolerance of `auto`."""


def measure(method: str, radius_mm: float, distance_mm: float, seed: int) -> float:
    """Return the RMS error of the markers (um) at the end of the way, against the finest grid."""
    return 1e6 * float(np.sqrt(((_dots(method, radius_mm, distance_mm) - _truth(radius_mm, distance_mm)) ** 2).mean()))


@lru_cache(maxsize=64)
def _truth(radius_mm: float, distance_mm: float) -> NDArray[np.float64]:
    return _dots("finest", radius_mm, distance_mm)


def _dots(method: str, radius_mm: float, distance_mm: float) -> NDArray[np.float64]:
    # A sphere of radius R that is pressed in by d touches within sqrt(R d) (Hertz).
    sphere = Sphere((radius_mm * 1e-3) ** 2 / INDENTATION_M)
    offset_m = GelMaterial().width_m / 2 - (radius_mm + distance_mm) * 1e-3
    shape = Moved(sphere, offset_m, 0.0)
    scene = Scene("patch", shape, INDENTATION_M, FRICTION, ((0.0, WAY_M / FRAMES, 0.0),) * FRAMES)
    x, y = np.meshgrid(np.linspace(-9e-3, 9e-3, 9), np.linspace(-7e-3, 7e-3, 7))
    trace = lead(_gel(method, shape), scene, np.stack([x.ravel(), y.ravel()], axis=1))
    return np.asarray(trace.dots_m[-1])


def _gel(method: str, shape: Shape) -> GelModel:
    from lsds_mocks.gel.auto.gel import AutoGel
    from lsds_mocks.gel.field.gel import FieldGel
    from lsds_mocks.gel.winkler import WinklerGel

    material = GelMaterial()
    if method == "auto":
        return AutoGel(shape, material)
    if method == "winkler":
        return WinklerGel(shape, material)
    if method == "half-space":
        return FieldGel(shape, material, fine=2, kernel="half-space")
    return FieldGel(shape, material, fine=GRIDS[method])


MAP = StabilityMap(
    "gel-models",
    "Gel models: RMS error of the markers against the finest grid",
    Axis("radius of the patch", "mm", (0.5, 1, 1.5, 2, 3, 4, 5), (1, 2, 4), (1, 3)),
    Axis("distance from the wall", "mm", (0.5, 1, 2, 3, 4, 5, 6), (1, 3, 6), (1, 5)),
    ("auto", "pad, grid 2", "pad, grid 1"),
    ("winkler", "half-space"),
    "error of the markers",
    "um",
    LIMIT_UM,
    measure,
    seeds={"full": 1, "quick": 1, "check": 1},
    notes=("a sphere is pressed in by 0.3 mm and then moves 0.5 mm along the wall",),
)
study = partial(StabilityStudy, MAP)
