"""Detector `imprint`: slip if the object's imprint moves against the gel by more than its errors explain.

Nothing is trained. The detector distinguishes three cases. The object stuck, and the load changed: the imprint's motion
against the gel is an error, of the size that `lsds.tactile.imprint.uncertainty` states. The object slipped: the motion
is larger, or the imprint is as strong as before but was not found again. The contact began or ended: the imprint was
not found again and has become much stronger or weaker, and the detector abstains. It also abstains without an imprint,
because noise does not match that of the last frame.
"""

from __future__ import annotations

import math

from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import BuildContext, Detection, Observation
from lsds.tactile.imprint.motion import FAINT_CURVATURE
from lsds.tactile.imprint.uncertainty import GEL_SHARE, distance, drift, step_m
from lsds.tactile.slip_residual import confidence


class ImprintDetectorOptions(BaseModel):
    """Options of `[detector.imprint]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    threshold: float = Field(
        default=2.4, gt=0, le=100, description="distance from sticking, in standard deviations, above which it slips"
    )
    least_mm: float = Field(
        default=0.04, ge=0, le=10, description="least motion between two frames that counts as slip"
    )
    least_match: float = Field(
        default=0.5, ge=0, le=1, description="correlation with the last frame's imprint below which it abstains"
    )
    least_strength: float = Field(
        default=FAINT_CURVATURE,
        ge=0,
        le=1,
        description="RMS curvature of the imprint below which it abstains: noise has as much",
    )
    gel_share: float = Field(
        default=GEL_SHARE,
        ge=0,
        le=1,
        description="share of the dots' motion by which that of the gel under the object is in doubt",
    )


class ImprintDetector:
    """A `Detector` on the imprint's motion in the last frames; it has no state."""

    def __init__(self, options: ImprintDetectorOptions, context: BuildContext) -> None:
        self._options = options

    def reset(self) -> None:
        """Do nothing: there is no state."""

    def update(self, observation: Observation) -> Detection:
        """Detect slip; abstain if the imprint's motion is unknown."""
        options = self._options
        recent = observation.imprint.recent() if observation.imprint is not None else []
        abstained = Detection(None, math.nan, options.threshold, 0.0)
        if not recent or recent[0].strength < options.least_strength:
            return abstained
        motion = recent[0]
        if motion.match < options.least_match:
            if abs(math.log(max(motion.grown, 1e-9))) > _BEGUN:
                return abstained
            return Detection(options.threshold < _LOST_SCORE, _LOST_SCORE, options.threshold, _LOST_CONFIDENCE)
        score = max(
            self._score(distance(motion, options.gel_share), step_m(motion)),
            self._score(*drift(recent, options.gel_share, options.least_match)),
        )
        return Detection(score > options.threshold, score, options.threshold, confidence(score, options.threshold))

    def _score(self, deviations: float, moved_m: float) -> float:
        least = self._options.least_mm * 1e-3
        return deviations * (min(1.0, moved_m / least) if least > 0 else 1.0)


#: A contact begins or ends if the imprint's strength changes by more than this, natural logarithm.
_BEGUN = 0.5
#: Score of an imprint that is as strong as before and was not found again: constant, so that a threshold separates it.
_LOST_SCORE = 10.0
#: Confidence in a slip that was too fast to be followed.
_LOST_CONFIDENCE = 0.5
