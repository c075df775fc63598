"""The history of a gel as a value."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class GelState:
    """History of a gel with N points.

    `deflection_m` and `shear_n` (2, N), `pressure_n` (N,) normal force in newtons and `slid` (N,) are per point;
    `reach_m` is the range of y under the object, None for all. A model with a changing set of points identifies them by
    `cells` (N,) of a grid `fine`. `placement` (x and y in metres, rotation in radians) is the position of the object's
    surface; `body` that of the object itself, which differs if the surface slides along itself.
    """

    deflection_m: NDArray[np.float64]
    shear_n: NDArray[np.float64]
    pressure_n: NDArray[np.float64]
    slid: NDArray[np.bool_]
    indentation_m: float
    normal_force_n: float
    reach_m: tuple[float, float] | None
    fine: int = 0
    cells: NDArray[np.int32] = field(default_factory=lambda: np.zeros(0, np.int32))
    placement: tuple[float, float, float] = (0.0, 0.0, 0.0)
    body: tuple[float, float, float] = (0.0, 0.0, 0.0)


def blend(early: GelState, late: GelState, share: float) -> GelState:
    """Return the state a `share` (0..1) of the way between two neighbouring steps, for an exposure between them."""
    if early.fine != late.fine:
        return late
    if early.cells is not late.cells and not np.array_equal(early.cells, late.cells):
        early = _over(late.cells, early)
    x, y, angle = (a + share * (b - a) for a, b in zip(early.placement, late.placement, strict=True))
    body_x, body_y, turn = (a + share * (b - a) for a, b in zip(early.body, late.body, strict=True))
    # In this form unchanged values stay bit-identical, so caches keyed by them still hit.
    return GelState(
        early.deflection_m + share * (late.deflection_m - early.deflection_m),
        early.shear_n + share * (late.shear_n - early.shear_n),
        early.pressure_n + share * (late.pressure_n - early.pressure_n),
        late.slid,
        early.indentation_m + share * (late.indentation_m - early.indentation_m),
        early.normal_force_n + share * (late.normal_force_n - early.normal_force_n),
        late.reach_m,
        late.fine,
        late.cells,
        (x, y, angle),
        (body_x, body_y, turn),
    )


def _over(cells: NDArray[np.int32], state: GelState) -> GelState:
    """Return a state's forces over other cells: zero where it had none; forces outside these cells are dropped."""
    _, here, there = np.intersect1d(cells, state.cells, assume_unique=True, return_indices=True)
    deflection, shear, pressure = np.zeros((2, len(cells))), np.zeros((2, len(cells))), np.zeros(len(cells))
    deflection[:, here], shear[:, here] = state.deflection_m[:, there], state.shear_n[:, there]
    pressure[here] = state.pressure_n[there]
    return replace(state, deflection_m=deflection, shear_n=shear, pressure_n=pressure, cells=cells)
