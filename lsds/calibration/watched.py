"""Answers of a cell's detectors on a recording whose slip is known."""

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
"""Kind of recording: "still" is at rest, "load" has changing load without slip, "slide" has slip at least in part."""
MOVING_FRAME_PX = 0.5
"""Minimum motion of the fastest tenth of the markers since the last frame in a moving frame, px of an image 320 px
wide."""
FIRST_FRAMES = 9
"""Number of frames at the start of a recording that are ignored: they may show an earlier contact."""


def fastest(moved: Floats) -> float:
    """Return the minimum motion of the fastest tenth of markers, from motions (n, 2); 0 without markers."""
    return float(np.quantile(np.hypot(moved[:, 0], moved[:, 1]), 0.9)) if len(moved) else 0.0


def fastest_px(observation: Observation, metres_per_px: float) -> float:
    """Return the minimum motion of the fastest tenth of the markers since the last frame, px of a 320 px wide image."""
    shown = observation.field
    known = np.isfinite(shown.velocity_m_s[:, 0])
    metres = metres_per_px * shown.reference.image_size[0] / WIDTH_PX
    return fastest(shown.velocity_m_s[known] * shown.dt_s) / metres


@dataclass(slots=True)
class WatchedPhase:
    """One recording, or one part of a live one: a row for each frame.

    `moved_px` is the markers' motion. `scores` and `thresholds` are by detector; a score is NaN if it abstains.
    `motions` are those of the imprint, None if unknown.
    """

    name: str
    phase: Phase
    moved_px: list[float] = field(default_factory=list)
    scores: dict[str, list[float]] = field(default_factory=dict)
    thresholds: dict[str, float] = field(default_factory=dict)
    motions: list[ImprintMotion | None] = field(default_factory=list)

    def take(self, cycle: Cycle, detectors: Mapping[str, Detector], metres_per_px: float) -> None:
        """Take a frame: update every detector. Raises PluginError for an answer without a score."""
        observation = cycle.observation
        self.moved_px.append(fastest_px(observation, metres_per_px))
        self.motions.append(None if observation.imprint is None else observation.imprint())
        for name, detector in detectors.items():
            detection = detector.update(observation)
            if detection.slip is not None and not np.isfinite(detection.score):
                raise PluginError(
                    f"detector '{name}': it decides without a score, so its threshold cannot be calibrated"
                )
            self.scores.setdefault(name, []).append(detection.score if detection.slip is not None else np.nan)
            self.thresholds[name] = detection.threshold

    def __len__(self) -> int:
        return len(self.moved_px)

    @property
    def counts(self) -> Mask:
        """Mask (n,) of the frames that count: all but the first few."""
        return np.arange(len(self)) >= FIRST_FRAMES

    @property
    def moving(self) -> Mask:
        """Mask (n,) of the frames that move."""
        return np.array(self.moved_px) > MOVING_FRAME_PX

    def score(self, detector: str) -> Floats:
        """Return a detector's scores (n,)."""
        return np.array(self.scores[detector], float)
