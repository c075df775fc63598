"""Rigid shapes that press on the gel: gap functions, and the geometry of their overlap with a flat gel.

`gap` is the distance (m) between the flat gel and the shape when it just touches, over gel coordinates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_mocks.gel.field.footprint import Placement


class Shape(Protocol):
    """A rigid object's surface where it meets the gel."""

    @property
    def angle_rad(self) -> float:
        """How the shape's own axes are turned against the gel's."""

    @property
    def roughness_m(self) -> float:
        """How far the surface may rise between two samples a hat apart, beyond what its outline says."""

    def slides_along(self, place: Placement, dx_m: float, dy_m: float, dtheta_rad: float) -> bool:
        """Tell whether a motion carries the surface along itself, so that the gap stays as it is."""

    def gap(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gap at touch, broadcast over `x_m` and `y_m`."""

    def overlap_volume(self, indentation_m: float) -> float:
        """Volume (m^3) between the flat gel and the shape at an indentation."""

    def half_extent(self, indentation_m: float) -> tuple[float, float]:
        """Half extents (m) of the overlap along the shape's own axes."""

    def area(self, indentation_m: float) -> float:
        """Area (m^2) of the overlap's outline."""

    def perimeter_per_area(self, indentation_m: float) -> float:
        """Perimeter to area ratio (1/m) of the overlap's outline, free ends at the pad's walls not counted."""


class _Smooth:
    """What holds for a shape without texture."""

    @property
    def roughness_m(self) -> float:
        """None."""
        return 0.0

    def slides_along(self, place: Placement, dx_m: float, dy_m: float, dtheta_rad: float) -> bool:
        """No motion leaves the gap as it is."""
        return False


@dataclass(frozen=True)
class Cylinder(_Smooth):
    """A cylinder lying on the gel, axis along y turned by `angle_rad`, as long as `length_m`."""

    radius_m: float
    length_m: float
    angle_rad: float = 0.0

    def slides_along(self, place: Placement, dx_m: float, dy_m: float, dtheta_rad: float) -> bool:
        """Along its axis."""
        angle = self.angle_rad + place.angle_rad
        return dtheta_rad == 0.0 and dx_m * math.cos(angle) + dy_m * math.sin(angle) == 0.0

    def gap(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gap at touch: parabola across the axis."""
        across = x_m * math.cos(self.angle_rad) + y_m * math.sin(self.angle_rad)
        gap: NDArray[np.float64] = across * across / (2 * self.radius_m)
        return gap

    def overlap_volume(self, indentation_m: float) -> float:
        """Volume of overlap: goes with the 3/2 power of the indentation."""
        return 4 / 3 * self.length_m * indentation_m * math.sqrt(2 * self.radius_m * indentation_m)

    def half_extent(self, indentation_m: float) -> tuple[float, float]:
        """Half width of the strip, half its length."""
        return math.sqrt(2 * self.radius_m * indentation_m), self.length_m / 2

    def area(self, indentation_m: float) -> float:
        """Width of the strip times its length."""
        return 2 * self.half_extent(indentation_m)[0] * self.length_m

    def perimeter_per_area(self, indentation_m: float) -> float:
        """Two long sides over the strip's area."""
        return 1 / self.half_extent(indentation_m)[0]


@dataclass(frozen=True)
class Sphere(_Smooth):
    """A sphere pressed at the pad's centre."""

    radius_m: float
    angle_rad: float = 0.0

    def gap(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gap at touch: paraboloid."""
        gap: NDArray[np.float64] = (x_m * x_m + y_m * y_m) / (2 * self.radius_m)
        return gap

    def overlap_volume(self, indentation_m: float) -> float:
        """Volume of the cap."""
        return math.pi * self.radius_m * indentation_m**2

    def half_extent(self, indentation_m: float) -> tuple[float, float]:
        """Radius of the circle, twice."""
        radius = math.sqrt(2 * self.radius_m * indentation_m)
        return radius, radius

    def area(self, indentation_m: float) -> float:
        """The circle's."""
        return math.pi * self.half_extent(indentation_m)[0] ** 2

    def perimeter_per_area(self, indentation_m: float) -> float:
        """A circle's 2/r."""
        return 2 / self.half_extent(indentation_m)[0]


@dataclass(frozen=True)
class Punch(_Smooth):
    """A flat rectangular face, `width_m` along x and `height_m` along y."""

    width_m: float
    height_m: float
    angle_rad: float = 0.0

    def gap(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Zero under the face, out of reach beside it."""
        inside = (np.abs(x_m) <= self.width_m / 2) & (np.abs(y_m) <= self.height_m / 2)
        return np.where(inside, 0.0, 1.0)

    def overlap_volume(self, indentation_m: float) -> float:
        """Area times indentation."""
        return self.width_m * self.height_m * indentation_m

    def half_extent(self, indentation_m: float) -> tuple[float, float]:
        """Half the face."""
        return self.width_m / 2, self.height_m / 2

    def area(self, indentation_m: float) -> float:
        """The face's."""
        return self.width_m * self.height_m

    def perimeter_per_area(self, indentation_m: float) -> float:
        """All four sides over the face."""
        return 2 * (self.width_m + self.height_m) / (self.width_m * self.height_m)
