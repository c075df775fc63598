"""A stability map: two axes, methods, the figure measured at a point, and its limit."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Literal

import numpy as np

Grid = Literal["full", "quick", "check"]
"""All points; those of `--quick`; the few of the test that compares the stored safe areas."""


@dataclass(frozen=True, slots=True)
class Axis:
    """A varied quantity, its unit, and its values on each grid."""

    name: str
    unit: str
    full: tuple[float, ...]
    quick: tuple[float, ...]
    check: tuple[float, ...]
    log: bool = False

    def on(self, grid: Grid) -> tuple[float, ...]:
        """Return the values of a grid."""
        return {"full": self.full, "quick": self.quick, "check": self.check}[grid]

    @property
    def label(self) -> str:
        """Name and unit, for a picture's axis."""
        return f"{self.name} ({self.unit})" if self.unit else self.name


Curve = tuple[str, str, Sequence[tuple[float, float]]]
"""The method that it is about, a label, and points (x, y)."""


@dataclass(frozen=True, slots=True)
class StabilityMap:
    """A figure over two axes, for several methods.

    `measure(method, x, y, seed)` returns the figure, which passes up to `limit`; infinity is a failure without a
    number. `naive` lists methods that are known to fail. `curves` are drawn over the panels of their methods;
    `remarks` are notes that have to be computed.
    """

    name: str
    title: str
    x: Axis
    y: Axis
    methods: tuple[str, ...]
    naive: tuple[str, ...]
    figure: str
    unit: str
    limit: float
    measure: Callable[[str, float, float, int], float]
    seeds: dict[Grid, int] = field(default_factory=lambda: {"full": 3, "quick": 1, "check": 1})
    notes: tuple[str, ...] = ()
    remarks: Callable[[], Sequence[str]] | None = None
    curves: Callable[[], Sequence[Curve]] | None = None
    log: bool = False

    def points(self, grid: Grid, seed: int, methods: Sequence[str] = ()) -> list[Point]:
        """Return all points of a grid, of the named methods or of all."""
        seeds = range(seed, seed + self.seeds[grid])
        methods_used = [name for name in (*self.methods, *self.naive) if not methods or name in methods]
        return [
            Point(self.name, method, x, y, own)
            for method, y, x, own in product(methods_used, self.y.on(grid), self.x.on(grid), seeds)
        ]


@dataclass(frozen=True, slots=True)
class Point:
    """One measurement: map, method, place and seed."""

    map: str
    method: str
    x: float
    y: float
    seed: int

    @property
    def key(self) -> str:
        """Key of this measurement."""
        return f"{self.map} {self.method} x={self.x!r} y={self.y!r} seed={self.seed}"


def worst(figures: Sequence[float]) -> float:
    """Return the worst figure; NaN counts as infinite."""
    return max((math.inf if math.isnan(each) else each for each in figures), default=math.inf)


def area(passes: Sequence[bool]) -> float:
    """Return the safe share of a map's points."""
    return float(np.mean(passes)) if passes else 0.0
