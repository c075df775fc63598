"""The gel of a finger at one instant, as recorded by cameras."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lsds.contracts import Vector2
    from lsds_mocks.gel.protocol import GelModel
    from lsds_mocks.gel.state import GelState


@dataclass(frozen=True, slots=True, eq=False)
class GelTouch:
    """A `Touch`: a gel model with one of its states."""

    gel: GelModel
    state: GelState

    @property
    def normal_n(self) -> float:
        """Normal force on the finger."""
        return self.state.normal_force_n

    @property
    def tangential_n(self) -> Vector2:
        """Shear force of the object on the gel (x, y)."""
        x, y = self.state.shear_n.sum(axis=1)
        return float(x), float(y)

    def displacement_m(self, xy_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the displacement (N, 2) of surface points (N, 2)."""
        return self.gel.marker_displacement(self.state, xy_m)

    def depth_m(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return the depth of the surface on a grid (H, W)."""
        return self.gel.depth(self.state, x_m, y_m)

    def contact_fraction(self, width_m: float, height_m: float) -> float:
        """Return the part of a centred window that the object touches."""
        return self.gel.contact_fraction(self.state, width_m, height_m)
