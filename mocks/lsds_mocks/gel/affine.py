"""Gel tier 'affine': dots dilate under the object and follow its shift and turn, up to a limit; no forces, no history
of friction. What image simulators commonly do (FOTS, Taxim), and the lower end of the ladder; it cannot hold an object.

With d the depth of the overlap and r the distance from the contact's middle, a dot at distance r moves by

    c_d sum_i d_i (x - x_i) exp(-|x - x_i|^2 / l_d^2) + s exp(-r^2 / l_s^2) + t x e_z (x - x_0) exp(-r^2 / l_t^2),

s and t being shift and turn, cut at s_max and t_max. The six numbers are fitted to one sphere (radius 12 mm, 0.4 mm
deep, friction 0.6) on the finite pad; other shapes are not what they were fitted to.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.gel.material import GelMaterial
from lsds_mocks.gel.protocol import Reaction
from lsds_mocks.gel.state import GelState
from lsds_mocks.gel.surface import contact_fraction, surface_depth

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.shapes import Shape


@dataclass(frozen=True, slots=True)
class AffineFit:
    """Dilation (1/m^2) with its length, shear's length and limit, turn's length and limit (m, rad)."""

    dilation_1_m2: float
    dilation_length_m: float
    shear_length_m: float
    most_shear_m: float
    turn_length_m: float
    most_turn_rad: float


SPHERE_FIT = AffineFit(113.4, 6.536e-3, 3.558e-3, 0.4408e-3, 2.413e-3, 0.2247)


class AffineGel:
    """A `GelModel` that moves dots only."""

    force_tolerance = 1e-12
    stick_ratio = 1.0
    fully_sliding = False
    elastic_energy_j = 0.0

    def __init__(self, shape: Shape, material: GelMaterial | None = None, fit: AffineFit = SPHERE_FIT) -> None:
        self.shape = shape
        self.material = material or GelMaterial()
        self.fit = fit
        step = 0.5e-3
        x = np.arange(-self.material.width_m / 2 + step / 2, self.material.width_m / 2, step)
        y = np.arange(-self.material.height_m / 2 + step / 2, self.material.height_m / 2, step)
        self._points = np.stack([axis.ravel() for axis in np.meshgrid(x, y)])
        self._area = step * step
        self._shift = np.zeros(3)
        self._tried = np.zeros(3)
        self._indentation = 0.0
        self._reach: tuple[float, float] | None = None

    @property
    def points_m(self) -> NDArray[np.float64]:
        """No friction is asked for anywhere."""
        return np.zeros((2, 0))

    @property
    def sliding(self) -> NDArray[np.bool_]:
        """Nothing slides."""
        return np.zeros(0, np.bool_)

    def press(self, indentation_m: float, reach_m: tuple[float, float] | None = None) -> float:
        """Set how deep the object stands; the normal force is not known."""
        self._indentation, self._reach = indentation_m, reach_m
        return 0.0

    def set_friction(self, friction: NDArray[np.float64]) -> None:
        """Ignored: the limit of the shift was fitted."""

    def trial(self, dx_m: float, dy_m: float, dtheta_rad: float = 0.0) -> Reaction:
        """Follow the object; what is beyond the limit is lost."""
        moved = self._shift + np.array([dx_m, dy_m, dtheta_rad])
        size = math.hypot(moved[0], moved[1])
        if size > self.fit.most_shear_m:
            moved[:2] *= self.fit.most_shear_m / size
        moved[2] = min(max(moved[2], -self.fit.most_turn_rad), self.fit.most_turn_rad)
        self._tried = moved
        return Reaction(0.0, 0.0, 0.0, 0.0, 0.0)

    def commit(self) -> None:
        """Make the last trial real."""
        self._shift = self._tried if self._indentation > 0 else np.zeros(3)

    def state(self) -> GelState:
        """Return a copy of the shift, as the deflection of one point."""
        return GelState(
            self._shift[:2, None].copy(), np.zeros((2, 1)), np.zeros(1), np.zeros(1, np.bool_), self._indentation, 0.0,
            self._reach, placement=(0.0, 0.0, float(self._shift[2])),
        )  # fmt: skip

    def restore(self, state: GelState) -> None:
        """Put a shift back."""
        self._shift = np.array([*state.deflection_m[:, 0], state.placement[2]])
        self._indentation, self._reach = state.indentation_m, state.reach_m

    def marker_displacement(self, state: GelState, xy_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (M, 2) metres, by the formula above."""
        overlap = np.maximum(state.indentation_m - self.shape.gap(self._points[0], self._points[1]), 0.0)
        under = overlap > 0
        if not under.any():
            return np.zeros_like(xy_m)
        points, depth = self._points[:, under], overlap[under]
        fit = self.fit
        away = xy_m[:, :, None] - points[None]
        weight = depth * np.exp(-(away**2).sum(axis=1) / fit.dilation_length_m**2) * self._area
        out = fit.dilation_1_m2 / fit.dilation_length_m**2 * (away * weight[:, None, :]).sum(axis=2)
        middle = points @ depth / depth.sum()
        off = xy_m - middle
        r2 = (off**2).sum(axis=1, keepdims=True)
        out += state.deflection_m[:, 0] * np.exp(-r2 / fit.shear_length_m**2)
        turned = state.placement[2] * np.stack([-off[:, 1], off[:, 0]], axis=1)
        return np.asarray(out + turned * np.exp(-r2 / fit.turn_length_m**2))

    def depth(self, state: GelState, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float32]:
        """Depth of the surface, see `lsds_mocks.gel.surface`."""
        return surface_depth(self.shape, state, x_m, y_m)

    def contact_fraction(self, state: GelState, width_m: float, height_m: float) -> float:
        """Fraction of the window in contact."""
        return contact_fraction(self.shape, state, width_m, height_m)
