"""What a cell's detectors say of a recording in which it is known whether something slips."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from lsds.errors import PluginError
from lsds.tactile.working_image import WIDTH_PX

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from lsds.contracts import Cycle, Detector, Observation
    from lsds.tactile.imprint.motion import ImprintMotion

    Floats = NDArray[np.float64]
    Mask = NDArray[np.bool_]

Phase = Literal["still", "load", "slide"]
"""Nothing moves; the load changes and nothing slips; the object slides, at least in a part of it."""
MOVING_PX = 0.5
"""A frame moves where the fastest tenth of the dots has moved by more than this since the last one, px of an image 320
px wide."""
FIRST_FRAMES = 9
"""Frames at the start of a recording that do not count: they may show an earlier contact."""


def fastest(moved: Floats) -> float:
    """Return how far the fastest tenth of dots that moved by (n, 2) has moved at least, 0 without dots."""
    return float(np.quantile(np.hypot(moved[:, 0], moved[:, 1]), 0.9)) if len(moved) else 0.0


def fastest_px(observation: Observation, metres_per_px: float) -> float:
    """Return how far the fastest tenth of the dots has moved since the last frame, px of an image 320 px wide."""
    shown = observation.field
    known = np.isfinite(shown.velocity_m_s[:, 0])
    metres = metres_per_px * shown.reference.image_size[0] / WIDTH_PX
    return fastest(shown.velocity_m_s[known] * shown.dt_s) / metres


@dataclass(slots=True)
class WatchedPhase:
    """One recording, or one part of a live one: a row for each frame.

    `moved_px` how far the dots have moved, `scores` and `thresholds` by detector, NaN where it abstains; `motions` of
    the imprint, None where it is not known.
    """

    name: str
    phase: Phase
    moved_px: list[float] = field(default_factory=list)
    scores: dict[str, list[float]] = field(default_factory=dict)
    thresholds: dict[str, float] = field(default_factory=dict)
    motions: list[ImprintMotion | None] = field(default_factory=list)

    def take(self, cycle: Cycle, detectors: Mapping[str, Detector], metres_per_px: float) -> None:
        """Take a frame: ask every detector. Raises PluginError for one without a score."""
        observation = cycle.observation
        self.moved_px.append(fastest_px(observation, metres_per_px))
        self.motions.append(None if observation.imprint is None else observation.imprint())
        for name, detector in detectors.items():
            said = detector.update(observation)
            if said.slip is not None and not np.isfinite(said.score):
                raise PluginError(f"detector '{name}': says slip or no slip without a score, so it has no threshold")
            self.scores.setdefault(name, []).append(said.score if said.slip is not None else np.nan)
            self.thresholds[name] = said.threshold

    def __len__(self) -> int:
        return len(self.moved_px)

    @property
    def counts(self) -> Mask:
        """Which frames count (n,): all but the first few."""
        return np.arange(len(self)) >= FIRST_FRAMES

    @property
    def moving(self) -> Mask:
        """Which frames move (n,)."""
        return np.array(self.moved_px) > MOVING_PX

    def score(self, detector: str) -> Floats:
        """Return a detector's scores (n,)."""
        return np.array(self.scores[detector], float)
