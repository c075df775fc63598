"""Disturbances of a lifted object: material is poured in, a push acts downwards, its surface gets wet."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(slots=True)
class Changes:
    """Changes that begin `after_s` after the object was lifted off the table.

    Pouring: the mass grows linearly to `mass_factor` times its initial value within `pour_s`. Push: a downward
    half-sine force with a peak of `shove_n` for `shove_s`. Wetting: friction is `friction_factor` times its initial
    value from then on.
    """

    after_s: float = 1.0
    mass_factor: float = 1.0
    pour_s: float = 3.0
    shove_n: float = 0.0
    shove_s: float = 0.2
    friction_factor: float = 1.0
    _begins_s: float = math.inf

    def step(self, time_s: float, lifted: bool) -> None:
        """Record the time at which the object first leaves the table."""
        if lifted and math.isinf(self._begins_s):
            self._begins_s = time_s + self.after_s

    def _since(self, time_s: float) -> float:
        return time_s - self._begins_s

    def mass(self, time_s: float) -> float:
        """Return the factor of the mass now."""
        share = min(max(self._since(time_s) / self.pour_s, 0.0), 1.0)
        return 1.0 + (self.mass_factor - 1.0) * share

    def push_n(self, time_s: float) -> float:
        """Return the downward force now, N."""
        since = self._since(time_s)
        return self.shove_n * math.sin(math.pi * since / self.shove_s) if 0.0 < since < self.shove_s else 0.0

    def friction(self, time_s: float) -> float:
        """Return the factor of friction now."""
        return self.friction_factor if self._since(time_s) >= 0.0 else 1.0
