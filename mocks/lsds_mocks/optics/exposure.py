"""Image brightness over time: dim and reddish first frames, slow drift, and optional fast changes."""

from __future__ import annotations

import math

import numpy as np

START_RGB = (0.87, 0.66, 0.66)
"""Gains (R, G, B) of the first frame of a clip that starts dim and red; the second is half way, the third settled."""
DRIFT_LEVELS = 0.3
"""Amplitude of the slow drift of brightness at a drift of 1, grey levels; agrees with that of recordings."""
_MEAN_LEVEL = 120.0
"""Grey level that converts changes in levels to gains; chosen."""


class Brightness:
    """Gains of each frame: `common` for all channels, `start` per channel in the first frames."""

    def __init__(self, start_up: bool, drift: float, swing_levels: float, rng: np.random.Generator) -> None:
        self._start_up = start_up
        self._drift = drift * DRIFT_LEVELS / _MEAN_LEVEL
        self._swing = swing_levels / _MEAN_LEVEL
        self._phase = rng.uniform(0, 2 * math.pi, 3).tolist()

    def common(self, t_s: float) -> float:
        """Return the gain at a time: drift over tens of seconds, swings within a few."""
        slow = math.sin(t_s / 9.0 + self._phase[0]) + 0.5 * math.sin(t_s / 3.7 + self._phase[1])
        return 1.0 + self._drift * slow + self._swing * math.sin(2 * math.pi * t_s / 2.5 + self._phase[2])

    def start(self, seq: int) -> tuple[float, float, float] | None:
        """Return the gains (R, G, B) of frame `seq`, None once settled."""
        if not self._start_up or seq >= 2:
            return None
        share = seq / 2
        red, green, blue = (gain + share * (1 - gain) for gain in START_RGB)
        return red, green, blue
