"""Vibration of the arm: a few micrometres at a few hertz, so that markers under a held object never rest completely."""

from __future__ import annotations

import math

import numpy as np

FREQUENCIES_HZ = (7.3, 12.9, 19.1)
"""Frequencies of the three sines, Hz; chosen."""
VIBRATION_SHARES = (0.5, 0.3, 0.2)
"""Shares of the amplitude that the sines have, in the order of their frequencies; chosen."""


class Vibration:
    """A sum of three sines with seeded phases; `amplitude_m` is the largest displacement they reach together."""

    def __init__(self, amplitude_m: float, rng: np.random.Generator) -> None:
        phases = rng.uniform(0, 2 * math.pi, len(VIBRATION_SHARES)).tolist()
        self._waves = [
            (amplitude_m * share, 2 * math.pi * hertz, phase, amplitude_m * share * math.sin(phase))
            for share, hertz, phase in zip(VIBRATION_SHARES, FREQUENCIES_HZ, phases, strict=True)
        ]
        if amplitude_m == 0:
            self._waves = []

    def displacement_m(self, t_s: float) -> float:
        """Return the upward displacement at a time."""
        total = 0.0
        for amplitude, omega, phase, at_start in self._waves:
            total += amplitude * math.sin(omega * t_s + phase) - at_start
        return total
