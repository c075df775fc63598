"""The history of a gel as a value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class GelState:
    """Shear deflection (2, N) in metres and shear force (2, N) in newtons of each point, normal force per point (N,)
    in newtons, which points slid, indentation (m), total normal force (N) and the stretch of y (m) under the object."""

    deflection_m: NDArray[np.float64]
    shear_n: NDArray[np.float64]
    pressure_n: NDArray[np.float64]
    slid: NDArray[np.bool_]
    indentation_m: float
    normal_force_n: float
    reach_m: tuple[float, float] | None


def blend(early: GelState, late: GelState, share: float) -> GelState:
    """Return the state a `share` (0..1) of the way between two neighbouring steps, for an exposure between them."""
    # In this form what did not change comes out unchanged to the last bit, and whoever keeps work by it finds it.
    return GelState(
        early.deflection_m + share * (late.deflection_m - early.deflection_m),
        early.shear_n + share * (late.shear_n - early.shear_n),
        early.pressure_n + share * (late.pressure_n - early.pressure_n),
        late.slid,
        early.indentation_m + share * (late.indentation_m - early.indentation_m),
        early.normal_force_n + share * (late.normal_force_n - early.normal_force_n),
        late.reach_m,
    )
