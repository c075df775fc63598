"""The needed force of a lift by the mocks' own laws, as columns for a forest that predicts failures.

A forest on some hundred lifts finds no product of mass, friction and curvature by itself. The necessary force and what
the gel carries at its greatest valid indentation are such products.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from lsds_mocks.cell.build import build_material, build_surface
from lsds_mocks.cell.options import CellOptions
from lsds_mocks.gel.auto.report import STRAIN_INVALID
from lsds_mocks.plant.lift import GRAVITY_M_S2
from lsds_mocks.plant.physics import FINGERS
from numpy.typing import NDArray
from pydantic import ValidationError

from lsds_research.search.objects import CELL
from lsds_research.search.space import Axis, Scenario, point_to_scenario, values_of

Floats = NDArray[np.float64]

SMOOTH = {"texture": "smooth", "texture_depth_mm": 0.0}
"""Options of a surface without relief, which takes longer to build than all else and does not change the load."""


class NeededForce:
    """Describes points of a space: the points (n, keys) and two columns, logarithms of the necessary normal force (N)
    and of its ratio to the force at the greatest valid indentation; both are 0 for an object that cannot be built.
    """

    def __init__(
        self, space: Sequence[Axis], complete: Callable[[Scenario], Scenario], settings: Sequence[str] = ()
    ) -> None:
        """`settings` are config keys of all lifts, and count above those of a scenario."""
        self._space, self._complete = space, complete
        self._settings = values_of(settings)

    def __call__(self, points: Sequence[Floats] | Floats) -> Floats:
        """Return the description (n, keys + 2)."""
        return np.array([[*point, *self._columns(point)] for point in points])

    def _columns(self, point: Floats) -> tuple[float, float]:
        keys = self._complete(point_to_scenario(self._space, point)) | self._settings
        own = {key.removeprefix(CELL): value for key, value in keys.items() if key.startswith(CELL)}
        try:
            options = CellOptions(**{**own, **SMOOTH})
            material = build_material(options)
            volume = build_surface(options, material).overlap_volume(STRAIN_INVALID * material.thickness_m)
        except (ValidationError, ValueError, OSError):
            return 0.0, 0.0
        friction = options.static_friction * options.friction_scale
        needed_n = options.mass_kg * GRAVITY_M_S2 / (FINGERS * friction)
        carried_n = material.normal_stiffness_n_m3 * volume
        return math.log(needed_n), math.log(needed_n / carried_n)
