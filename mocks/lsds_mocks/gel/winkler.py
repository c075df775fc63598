"""Gel model `winkler`: independent bristles over the contact patch, each with its own Coulomb limit.

A bristle's root rests in the gel's base and its tip rides on the object until the force exceeds friction times the
bristle's share of the normal force; then the tip is drawn back onto that limit (elastic predictor, plastic corrector,
backward Euler). The pressure falls toward the patch's edge, so the edge slides first and the centre last.
`lsds_mocks.gel.markers` computes the marker positions.
"""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from lsds_mocks.gel.kernel import DEFAULT_KERNEL, MarkerKernel
from lsds_mocks.gel.markers import MarkerField
from lsds_mocks.gel.material import CONTACT_LEVEL, PRESSURE_EXPONENT, GelMaterial
from lsds_mocks.gel.protocol import NO_REACTION, Reaction
from lsds_mocks.gel.state import GelState
from lsds_mocks.gel.surface import contact_fraction, surface_depth

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.shapes import Shape
    from lsds_mocks.optics.grain import Grain

#: A bristle slides when the friction limit scales its trial force below this share; 1 less a rounding error.
SLIDING_SCALE = 1.0 - 1e-9
#: Share of the pad's length below which an object does not touch the pad; chosen.
_LEAST_COVERAGE = 0.05
#: Number of marker fields that are kept, one for each finger.
_FINGERS = 2
#: A deflection (m) far below any real one: keeps 0 / 0 out of a bristle at rest.
_SMALLEST_DEFLECTION_M = 1e-300


def bristle_grid(shape: Shape, material: GelMaterial, indentation_m: float, count: int) -> NDArray[np.float64]:
    """Return about `count` points (2, N) over the patch at an indentation."""
    half_x, half_y = shape.half_extent(CONTACT_LEVEL * indentation_m)
    columns = max(4, round(math.sqrt(count * half_x / half_y) * 1.4)) if half_x < half_y else round(math.sqrt(count))
    rows = max(4, round(count / columns))
    across = (np.arange(columns) + 0.5) / columns * 2 * half_x - half_x
    along = (np.arange(rows) + 0.5) / rows * 2 * half_y - half_y
    u, v = (axis.ravel() for axis in np.meshgrid(across, along))
    cos, sin = math.cos(shape.angle_rad), math.sin(shape.angle_rad)
    points = np.stack([u * cos - v * sin, u * sin + v * cos])
    inside = (np.abs(points[0]) <= material.width_m / 2) & (np.abs(points[1]) <= material.height_m / 2)
    return np.ascontiguousarray(points[:, inside])


class WinklerGel:
    """A `GelModel` of bristles; `design_m` is the deepest indentation that the grid of points covers."""

    grain: Grain | None = None

    def __init__(
        self,
        shape: Shape,
        material: GelMaterial | None = None,
        *,
        count: int = 100,
        design_m: float = 0.8e-3,
        kernel: MarkerKernel = DEFAULT_KERNEL,
    ) -> None:
        self.shape = shape
        self.material = material or GelMaterial()
        self.kernel = kernel
        self._points = bristle_grid(shape, self.material, design_m, count)
        size = self._points.shape[1]
        self._gap = shape.gap(self._points[0], self._points[1])
        self._u = np.zeros((2, size))
        self._own_u = np.zeros((2, size))
        self._try = np.zeros((2, size))
        self._try_x, self._try_y = self._try
        self._shift = np.zeros((2, 1))
        self._force = np.zeros(2)
        self._limit = np.zeros(size)
        self._floor = np.full(size, _SMALLEST_DEFLECTION_M)
        self._scale = np.ones(size)
        self._kept_scale = np.ones(size)
        self._pressure = np.zeros(size)
        self._k = self._own_k = 1.0
        self._touching = 0
        self._tried_stuck = self._stuck = 0
        self._contact = np.zeros(size, bool)
        self._holds = np.zeros(size, bool)
        self._loaded: tuple[float, float, tuple[float, float] | None] = (0.0, 0.0, None)
        self._fields: deque[MarkerField] = deque(maxlen=_FINGERS)

    @property
    def points_m(self) -> NDArray[np.float64]:
        """Roots of the bristles, (2, N)."""
        return self._points

    def normal_force(self, indentation_m: float, coverage: float = 1.0) -> float:
        """Stiffness times overlap volume, see `lsds_mocks.gel.material`."""
        if indentation_m <= 0:
            return 0.0
        return self.material.normal_stiffness_n_m3 * self.shape.overlap_volume(indentation_m) * coverage

    @property
    def force_tolerance(self) -> float:
        """Negligible, because forces are computed in closed form."""
        return 1e-12

    def coverage(self, reach_m: tuple[float, float] | None) -> float:
        """Fraction of the pad's length that an object over a range of y covers; tiny fractions count as 0."""
        if reach_m is None:
            return 1.0
        share = max(0.0, reach_m[1] - reach_m[0]) / self.material.height_m
        return share if share >= _LEAST_COVERAGE else 0.0

    def press(self, indentation_m: float, reach_m: tuple[float, float] | None = None) -> float:
        """Distribute the normal force over the bristles in contact; return it (N)."""
        if (indentation_m, reach_m) == self._loaded[::2]:
            return self._loaded[1]
        normal_force_n = self.normal_force(indentation_m, self.coverage(reach_m))
        self._load(indentation_m, normal_force_n, reach_m)
        return normal_force_n

    def _load(self, indentation_m: float, normal_force_n: float, reach_m: tuple[float, float] | None) -> None:
        self._loaded = (indentation_m, normal_force_n, reach_m)
        edge = CONTACT_LEVEL * max(indentation_m, 1e-12)
        weight = np.maximum(1.0 - self._gap / edge, 0.0) ** PRESSURE_EXPONENT
        self._stiffen(edge, weight > 0)
        if reach_m is not None:
            weight *= (self._points[1] >= reach_m[0]) & (self._points[1] <= reach_m[1])
        total = float(weight.sum())
        self._pressure = weight * (normal_force_n / total) if total > 0 else np.zeros_like(weight)
        self._contact = self._pressure > 0
        self._touching = int(np.count_nonzero(self._contact))

    def _stiffen(self, edge_m: float, under: NDArray[np.bool_]) -> None:
        """Distribute the contact's shear stiffness over the bristles under the object.

        A bristle that gets stiffer than at the last commit is drawn back so that its force stays the same, which cannot
        increase its energy.
        """
        touching = int(np.count_nonzero(under))
        if not touching:
            return
        per_area = self.material.shear_stiffness_n_m3(self.shape.perimeter_per_area(edge_m))
        stiffness = per_area * self.shape.area(edge_m) / touching
        np.multiply(self._own_u, min(self._own_k / stiffness, 1.0), out=self._u)
        self._k = stiffness

    def set_friction(self, friction: NDArray[np.float64]) -> None:
        """Set the deflection at which each bristle slips."""
        limit = self._limit
        np.multiply(friction, self._pressure, out=limit)
        limit /= self._k
        np.maximum(limit, _SMALLEST_DEFLECTION_M, out=self._floor)

    def trial(self, dx_m: float, dy_m: float, dtheta_rad: float = 0.0) -> Reaction:
        """Return the reaction: move all tips with the object, draw back those beyond their limit, add up the forces."""
        if not self._touching:
            return NO_REACTION
        moved, scale = self._try, self._scale
        self._shift[0, 0], self._shift[1, 0] = dx_m, dy_m
        np.add(self._u, self._shift, out=moved)
        if dtheta_rad:
            self._try_x -= dtheta_rad * self._points[1]
            self._try_y += dtheta_rad * self._points[0]
        # A tip keeps the share min(1, limit / |u|) of its deflection.
        np.hypot(self._try_x, self._try_y, out=scale)
        np.maximum(scale, self._floor, out=scale)
        np.divide(self._limit, scale, out=scale)
        k = self._k
        fx, fy = np.dot(moved, scale, out=self._force).tolist()
        torque = 0.0
        if dtheta_rad or fx or fy:
            torque = k * float((self._points[0] * self._try_y - self._points[1] * self._try_x) @ scale)
        self._tried_stuck = int(np.count_nonzero(np.greater_equal(scale, SLIDING_SCALE, out=self._holds)))
        return Reaction(k * fx, k * fy, torque, k * self._tried_stuck, self._loaded[1])

    def commit(self) -> None:
        """Keep the last trial's drawn-back deflections; without contact the gel springs back at once."""
        self._own_k = self._k
        if not self._touching:
            self._u.fill(0.0)
            self._own_u.fill(0.0)
            self._kept_scale.fill(0.0)
            self._stuck = 0
            return
        np.multiply(self._try, self._scale, out=self._u)
        np.copyto(self._own_u, self._u)
        self._scale, self._kept_scale = self._kept_scale, self._scale
        self._stuck = self._tried_stuck

    @property
    def sliding(self) -> NDArray[np.bool_]:
        """Which bristles slid in the last committed step, those without contact included."""
        return self._kept_scale < SLIDING_SCALE

    @property
    def stick_ratio(self) -> float:
        """Share of the bristles in contact that did not slide."""
        return self._stuck / self._touching if self._touching else 1.0

    @property
    def fully_sliding(self) -> bool:
        """Whether every bristle in contact slid in the last committed step."""
        return self._touching > 0 and self._stuck == 0

    @property
    def elastic_energy_j(self) -> float:
        """Sum of half k u^2."""
        return 0.5 * self._k * float((self._u * self._u).sum())

    def state(self) -> GelState:
        """Return a copy of the history."""
        indentation, force, reach = self._loaded
        return GelState(self._u.copy(), self._k * self._u, self._pressure, self.sliding, indentation, force, reach)

    def restore(self, state: GelState) -> None:
        """Put a history back."""
        self._load(state.indentation_m, state.normal_force_n, state.reach_m)
        self._u[:] = self._own_u[:] = state.deflection_m
        self._own_k = self._k
        self._kept_scale[:] = ~state.slid
        self._stuck = int(np.count_nonzero(self._contact & ~state.slid))

    def marker_displacement(self, state: GelState, xy_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `lsds_mocks.gel.markers`; the matrices are kept for the points of both fingers."""
        field = next((known for known in self._fields if known.xy_m is xy_m), None)
        if field is None:
            field = MarkerField(xy_m, self._points, self.kernel)
            self._fields.append(field)
        force = np.concatenate([state.shear_n.ravel(), state.pressure_n])
        return field.displacement(force, state.deflection_m, self.middle(state))

    def middle(self, state: GelState) -> NDArray[np.float64]:
        """Return (N,) the depth of each bristle within the contact: 1 at first touch, 0 at the rim and beyond."""
        share = np.maximum(1.0 - self._gap / (CONTACT_LEVEL * max(state.indentation_m, 1e-12)), 0.0)
        return np.asarray(np.where(state.pressure_n > 0, share, 0.0))

    def depth(self, state: GelState, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float32]:
        """Depth of the surface, see `lsds_mocks.gel.surface`."""
        return surface_depth(self.shape, state, x_m, y_m)

    def contact_fraction(self, state: GelState, width_m: float, height_m: float) -> float:
        """Fraction of the window in contact."""
        return contact_fraction(self.shape, state, width_m, height_m)
