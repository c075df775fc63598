"""Detector `rigid-residual`: what the best rigid or affine motion of the markers leaves unexplained.

Where the object sticks, it carries the markers under it along as one: their velocities are those of a rigid body, or
of a gel sheared evenly. Where it slips, each marker goes its own way (Dong et al. 2019). Nothing is trained; the
threshold stands a few times above the tracker's own jitter.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import BuildContext, Detection, Observation
from lsds.tactile.contact_markers import markers_in_contact
from lsds.tactile.motion_fit import fit_affine, fit_rigid


class RigidResidualOptions(BaseModel):
    """Options of `[detector.rigid-residual]`."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    residual_m_s: float = Field(
        default=9.0e-5, gt=0, le=1, description="RMS residual velocity above which it slips (1.4 px/s on a Mini)"
    )
    motion: Literal["rigid", "affine"] = Field(default="affine", description="the motion that counts as sticking")
    frames: int = Field(default=1, ge=1, le=100, description="frames whose residuals are pooled")
    least_markers: int = Field(default=6, ge=4, le=1000, description="fewer valid markers than this: abstain")


class RigidResidualDetector:
    """A `Detector` on the pooled residual of the last frames' velocity fields."""

    def __init__(self, options: RigidResidualOptions, context: BuildContext) -> None:
        self._options = options
        self._fit = fit_rigid if options.motion == "rigid" else fit_affine
        self.reset()

    def reset(self) -> None:
        """Forget the past frames."""
        self._squares: deque[float] = deque(maxlen=self._options.frames)

    def update(self, observation: Observation) -> Detection:
        """Decide; abstain with too few markers or no velocity."""
        threshold = self._options.residual_m_s
        square = self._mean_square(observation)
        if square is None:
            self._squares.clear()
            return Detection(None, math.nan, threshold, 0.0)
        self._squares.append(square)
        score = math.sqrt(sum(self._squares) / len(self._squares))
        confidence = 1 - 0.2 ** abs(math.log2(max(score, 1e-12) / threshold))
        return Detection(score > threshold, score, threshold, confidence)

    def _mean_square(self, observation: Observation) -> float | None:
        chosen = markers_in_contact(observation, self._options.least_markers)
        velocity: NDArray[np.float64] = observation.field.velocity_m_s
        chosen = chosen & np.isfinite(velocity[:, 0])
        if np.count_nonzero(chosen) < self._options.least_markers:
            return None
        motion = self._fit(observation.field.position_m[chosen], velocity[chosen])
        if motion is None:
            return None
        residual = motion.residual
        return float(np.einsum("ni,ni->", residual, residual)) / len(residual)
