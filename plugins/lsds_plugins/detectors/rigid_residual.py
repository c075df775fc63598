"""Detector `rigid-residual`: the residual of the markers' velocities after the best rigid or affine motion.

Nothing is trained (cf. Dong et al. 2019, who take the residual of the rigid motion). The statistic is the residual's
excess along the shear, see `lsds.tactile.slip_residual`; the threshold is a few times the tracker's jitter.
"""

from __future__ import annotations

import math
from collections import deque

from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import BuildContext, Detection, Observation
from lsds.tactile.slip_residual import Motion, confidence, slip_residual


class RigidResidualOptions(BaseModel):
    """Options of `[detector.rigid-residual]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    residual_m_s: float = Field(
        default=5.0e-5,
        gt=0,
        le=1,
        description="RMS residual velocity above which slip is detected (0.8 px/s on a Mini)",
    )
    motion: Motion = Field(default="quadratic", description="motion model that counts as sticking")
    frames: int = Field(default=1, ge=1, le=100, description="frames whose residuals are pooled")
    least_markers: int = Field(
        default=6, ge=4, le=1000, description="minimum number of valid markers; with fewer it abstains"
    )


class RigidResidualDetector:
    """A `Detector` on the pooled residual of the last frames' velocity fields."""

    def __init__(self, options: RigidResidualOptions, context: BuildContext) -> None:
        self._options = options
        self.reset()

    def reset(self) -> None:
        """Clear the past frames."""
        self._squares: deque[float] = deque(maxlen=self._options.frames)

    def update(self, observation: Observation) -> Detection:
        """Detect slip; abstain with too few markers or no velocity."""
        threshold = self._options.residual_m_s
        evidence = slip_residual(observation, self._options.motion, self._options.least_markers)
        if evidence is None:
            self._squares.clear()
            return Detection(None, math.nan, threshold, 0.0)
        self._squares.append(evidence.excess)
        score = math.sqrt(sum(self._squares) / len(self._squares))
        return Detection(score > threshold, score, threshold, confidence(score, threshold))
