"""The curves of a run: points over time, thinned without loss of a peak."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

MOST_POINTS = 12_000
"""Most points of a curve in a page. A longer curve keeps the smallest and the largest value of each section."""
CURVE_DIGITS = 5
"""Significant digits of a value in a page."""


@dataclass(slots=True)
class Curve:
    """Values over time (s), with the standard deviation of each if it has a band; NaN where a value is unknown."""

    t_s: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    stds: list[float] = field(default_factory=list)

    def add(self, t_s: float, value: float | None, scale: float = 1.0, std: float | None = None) -> None:
        """Add a point, multiplied by `scale`; None is an unknown number."""
        self.t_s.append(t_s)
        self.values.append(math.nan if value is None else scale * value)
        self.stds.append(math.nan if std is None else scale * std)

    @property
    def known(self) -> bool:
        """Whether any value is known."""
        return any(map(math.isfinite, self.values))

    def thinned(self, most: int = MOST_POINTS) -> Curve:
        """Return the curve with at most `most` points; it keeps the extremes and the gaps of each section."""
        count = len(self.values)
        if count <= most:
            return self
        length = math.ceil(3 * count / most)
        kept: set[int] = set()
        for begin in range(0, count, length):
            section = range(begin, min(begin + length, count))
            known = [at for at in section if math.isfinite(self.values[at])]
            if known:
                kept |= {min(known, key=self.values.__getitem__), max(known, key=self.values.__getitem__)}
            if len(known) < len(section):
                kept.add(next(at for at in section if not math.isfinite(self.values[at])))
        order = sorted(kept)
        return Curve(*([column[at] for at in order] for column in (self.t_s, self.values, self.stds)))


def numbers(values: list[float]) -> list[float | None]:
    """Return numbers for a page: short, and None for an unknown one."""
    return [float(f"{value:.{CURVE_DIGITS}g}") if math.isfinite(value) else None for value in values]
