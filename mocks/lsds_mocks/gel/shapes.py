"""Rigid shapes that press on the gel: gap functions, and the geometry of their overlap with a flat gel.

`gap` is the distance (m) between the flat gel and the shape when it just touches, over gel coordinates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numba import njit

from lsds_mocks.gel.overlap import Overlap
from lsds_mocks.gel.placement import Placement

if TYPE_CHECKING:
    from numpy.typing import NDArray

Motion = tuple[float, float, float]
"""Motion of an object over the pad: dx and dy (m), and rotation about the pad's centre (rad)."""


class Shape(Protocol):
    """A rigid object's surface where it meets the gel."""

    @property
    def angle_rad(self) -> float:
        """Rotation of the shape's axes relative to the gel's."""
        ...

    def least_gap(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gap of the shape without its texture, which only makes it larger."""
        ...

    def slides_along(self, place: Placement, motion: Motion, pad_m: tuple[float, float]) -> bool:
        """Return whether a motion leaves the gap unchanged everywhere on a pad of width and height `pad_m`."""
        ...

    def gap(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gap at touch, broadcast over `x_m` and `y_m`."""
        ...

    def overlap_volume(self, indentation_m: float) -> float:
        """Volume (m^3) between the flat gel and the shape at an indentation."""
        ...

    def half_extent(self, indentation_m: float) -> tuple[float, float]:
        """Half extents (m) of the overlap along the shape's own axes."""
        ...

    def area(self, indentation_m: float) -> float:
        """Area (m^2) of the overlap's outline."""
        ...

    def perimeter_per_area(self, indentation_m: float) -> float:
        """Perimeter to area ratio (1/m) of the overlap's outline, free ends at the pad's walls not counted."""
        ...


@dataclass(frozen=True)
class Surface:
    """Properties of any shape computed from its gap alone; shapes with a better solution override them."""

    def least_gap(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gap of the shape: no texture."""
        return self.gap(x_m, y_m)

    def slides_along(self, place: Placement, motion: Motion, pad_m: tuple[float, float]) -> bool:
        """Return False: the gap of a general surface changes with every motion."""
        return False

    def gap(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gap at touch."""
        raise NotImplementedError

    def overlap_volume(self, indentation_m: float) -> float:
        """Sum over a lattice as large as a pad."""
        return self._overlap.depth_m(indentation_m) * _LATTICE_M**2

    def half_extent(self, indentation_m: float) -> tuple[float, float]:
        """Farthest points of the overlap from the middle."""
        overlap = self._overlap
        across, along = overlap.columns_m < indentation_m, overlap.rows_m < indentation_m
        if not across.any():
            return _LATTICE_M, _LATTICE_M
        return (
            float(np.abs(_ACROSS[across]).max()) + _LATTICE_M / 2,
            float(np.abs(_ALONG[along]).max()) + _LATTICE_M / 2,
        )

    def area(self, indentation_m: float) -> float:
        """Count of lattice points."""
        return max(1, self._overlap.points(indentation_m)) * _LATTICE_M**2

    def perimeter_per_area(self, indentation_m: float) -> float:
        """Count of lattice edges on the outline, times pi/4 because a slanted outline is counted in steps."""
        return math.pi / 4 * self._overlap.edges(indentation_m) * _LATTICE_M / self.area(indentation_m)

    @cached_property
    def _overlap(self) -> Overlap:
        gap = self.gap(_ACROSS[None, :], _ALONG[:, None])
        return Overlap(np.broadcast_to(gap, (len(_ALONG), len(_ACROSS))))


@dataclass(frozen=True)
class Unturned(Surface):
    """A shape whose axes are parallel to the gel's."""

    @property
    def angle_rad(self) -> float:
        """Not turned."""
        return 0.0


_LATTICE_M = 0.24e-3
"""Pitch of the lattice on which an overlap is counted, m; chosen so that it divides the pad's width and height."""
_PAD_M = (24.96e-3, 20.16e-3)
"""Width and height of the lattice, m: those of the pad in `GelMaterial`."""
_ACROSS: NDArray[np.float64] = np.asarray((np.arange(104) - 51.5) * _LATTICE_M, np.float64)
_ALONG: NDArray[np.float64] = np.asarray((np.arange(84) - 41.5) * _LATTICE_M, np.float64)


@dataclass(frozen=True)
class Cylinder(Surface):
    """A cylinder of length `length_m` lying on the gel, its axis turned from y by `angle_rad`."""

    radius_m: float
    length_m: float
    angle_rad: float = 0.0

    def slides_along(self, place: Placement, motion: Motion, pad_m: tuple[float, float]) -> bool:
        """Along its axis."""
        dx_m, dy_m, dtheta_rad = motion
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
class Sphere(Surface):
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
        """Return the area of the circle (m^2)."""
        return math.pi * self.half_extent(indentation_m)[0] ** 2

    def perimeter_per_area(self, indentation_m: float) -> float:
        """Return 2 / r of the circle (1/m)."""
        return 2 / self.half_extent(indentation_m)[0]


@dataclass(frozen=True)
class Flat(Unturned):
    """An unbounded flat face."""

    def slides_along(self, place: Placement, motion: Motion, pad_m: tuple[float, float]) -> bool:
        """However it moves."""
        return True

    def gap(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """None, anywhere."""
        return np.zeros(np.broadcast_shapes(np.shape(x_m), np.shape(y_m)))


@dataclass(frozen=True)
class Box(Surface):
    """A flat rectangular face with rounded edges: `width_m` along x, `height_m` along y, edge radius `edge_m`."""

    width_m: float
    height_m: float
    edge_m: float = 0.5e-3
    angle_rad: float = 0.0

    def slides_along(self, place: Placement, motion: Motion, pad_m: tuple[float, float]) -> bool:
        """Return whether the motion is along the edges, or crosses only edges that stay beyond the pad."""
        after = place.moved(*motion)
        angle = self.angle_rad + place.angle_rad
        cos, sin = math.cos(angle), math.sin(angle)
        ways = motion[0] * cos + motion[1] * sin, motion[1] * cos - motion[0] * sin
        for axis, size in enumerate((self.width_m, self.height_m)):
            reach = size / 2 - self.edge_m
            beyond = all(_farthest(self.angle_rad, at, pad_m)[axis] <= reach for at in (place, after))
            if not beyond and (motion[2] != 0.0 or ways[axis] != 0.0):
                return False
        return True

    def gap(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Zero under the face, a quarter circle at its edges, a wall beyond."""
        x, y = np.broadcast_arrays(x_m, y_m)
        gap = np.empty(x.shape)
        _box_gap(x.ravel(), y.ravel(), self.angle_rad, self.width_m / 2, self.height_m / 2, self.edge_m, gap.ravel())
        return gap

    def overlap_volume(self, indentation_m: float) -> float:
        """Area times indentation."""
        return self.area(indentation_m) * indentation_m

    def half_extent(self, indentation_m: float) -> tuple[float, float]:
        """Half of the face, limited to the pad."""
        return min(self.width_m, _PAD_M[0]) / 2, min(self.height_m, _PAD_M[1]) / 2

    def area(self, indentation_m: float) -> float:
        """The face's."""
        half_x, half_y = self.half_extent(indentation_m)
        return 4 * half_x * half_y

    def perimeter_per_area(self, indentation_m: float) -> float:
        """All four sides over the face."""
        half_x, half_y = self.half_extent(indentation_m)
        return (half_x + half_y) / (half_x * half_y)


def _farthest(angle_rad: float, place: Placement, pad_m: tuple[float, float]) -> tuple[float, float]:
    """Return how far (m) the pad extends from an object's origin in either direction, along each of its axes."""
    angle = angle_rad + place.angle_rad
    cos, sin = math.cos(angle), math.sin(angle)
    across = abs(place.x_m * cos + place.y_m * sin) + (pad_m[0] * abs(cos) + pad_m[1] * abs(sin)) / 2
    along = abs(place.y_m * cos - place.x_m * sin) + (pad_m[0] * abs(sin) + pad_m[1] * abs(cos)) / 2
    return across, along


_WALL = 20.0
"""Slope of a wall: steep, but finite so that a cell's mean gap stays finite."""


@dataclass(frozen=True)
class Moved(Unturned):
    """Another shape with its origin moved on the pad."""

    base: Shape
    x_m: float
    y_m: float

    def gap(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gap of the moved shape."""
        return self.base.gap(x_m - self.x_m, y_m - self.y_m)

    def least_gap(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Least gap of the moved shape."""
        return self.base.least_gap(x_m - self.x_m, y_m - self.y_m)

    def slides_along(self, place: Placement, motion: Motion, pad_m: tuple[float, float]) -> bool:
        """Return whether the original shape slides along itself."""
        cos, sin = math.cos(place.angle_rad), math.sin(place.angle_rad)
        origin = place.x_m + cos * self.x_m - sin * self.y_m, place.y_m + sin * self.x_m + cos * self.y_m
        return self.base.slides_along(Placement(*origin, place.angle_rad), motion, pad_m)


@njit(cache=True)  # type: ignore[untyped-decorator]
def _box_gap(
    x_m: NDArray[np.float64],
    y_m: NDArray[np.float64],
    angle_rad: float,
    half_x_m: float,
    half_y_m: float,
    edge_m: float,
    gap: NDArray[np.float64],
) -> None:
    """Write the gap (n,) of a box with round edges at points (n,)."""
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    face_x, face_y = half_x_m - edge_m, half_y_m - edge_m
    for i in range(gap.size):
        across = max(abs(x_m[i] * cos + y_m[i] * sin) - face_x, 0.0)
        along = max(abs(y_m[i] * cos - x_m[i] * sin) - face_y, 0.0)
        # Most points lie under the face.
        if across == 0.0 and along == 0.0:
            gap[i] = 0.0
            continue
        away = math.hypot(across, along)
        if away < edge_m:
            gap[i] = edge_m - math.sqrt(max(edge_m * edge_m - away * away, 0.0))
        else:
            gap[i] = edge_m + _WALL * (away - edge_m)
