"""Detector `threshold`: a threshold on the larger v_net of the last two frames.

The one-parameter baseline for every learned detector: on the paper's released sample it scores 99.76 %.
"""

from __future__ import annotations

import math

from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import BuildContext, Detection, Observation
from lsds.tactile.slip_residual import confidence


class ThresholdOptions(BaseModel):
    """Options of `[detector.threshold]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    v_net_m_s: float = Field(
        default=2.5e-4, gt=0, le=1, description="mean marker velocity above which slip is detected (4 px/s on a Mini)"
    )


class ThresholdDetector:
    """A `Detector` with one parameter and two frames of memory."""

    def __init__(self, options: ThresholdOptions, context: BuildContext) -> None:
        self._threshold = options.v_net_m_s
        self.reset()

    def reset(self) -> None:
        """Clear the last frame."""
        self._last = math.nan

    def update(self, observation: Observation) -> Detection:
        """Detect slip; abstain if neither frame has a velocity."""
        now = observation.features["v_net"]
        known = [v for v in (now, self._last) if not math.isnan(v)]
        self._last = now
        if not known:
            return Detection(None, math.nan, self._threshold, 0.0)
        score = max(known)
        slip = score > self._threshold
        return Detection(slip, score, self._threshold, confidence(score, self._threshold))
