"""Estimator `imprint`: slip velocity as the motion of the object's imprint against the gel. Nothing is trained.

The imprint's motion since the last frame, divided by the measured interval (`lsds.tactile.imprint`). Along an edge, and
where a smooth object shows nothing, the standard deviation says so. It abstains where the imprint of the last frame is
not found again.
"""

from __future__ import annotations

import math

from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import BuildContext, Observation, SlipEstimate
from lsds.tactile.imprint.uncertainty import GEL_SHARE, covariance


class ImprintOptions(BaseModel):
    """Options of `[estimator.imprint]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    least_match: float = Field(
        default=0.6, ge=0, le=1, description="correlation with the last frame's imprint below which it abstains"
    )
    gel_share: float = Field(
        default=GEL_SHARE,
        ge=0,
        le=1,
        description="share of the dots' motion by which that of the gel under the object is in doubt",
    )


class ImprintEstimator:
    """An `Estimator` that looks at two frames and keeps no state."""

    def __init__(self, options: ImprintOptions, context: BuildContext) -> None:
        self._options = options

    def reset(self) -> None:
        """Nothing to forget."""

    def update(self, observation: Observation) -> SlipEstimate:
        """Estimate; abstain where the imprint's motion is not known. Angles turn clockwise on the image (x to y)."""
        motion = observation.imprint() if observation.imprint is not None else None
        dt = observation.dt_s
        if motion is None or not dt > 0 or motion.match < self._options.least_match:
            return ABSTAINED
        spread = covariance(motion, self._options.gel_share)
        x, y = motion.slip_m
        std_x, std_y, std_turn = (math.sqrt(spread[k, k]) / dt for k in range(3))
        length = math.hypot(x, y)
        # Along the slip; for one of no length, the mean of both directions.
        along = (
            (x * (x * spread[0, 0] + 2 * y * spread[0, 1]) + y * y * spread[1, 1]) / length**2 if length > 0 else 0.0
        )
        speed_var = along if length > 0 else (spread[0, 0] + spread[1, 1]) / 2
        return SlipEstimate(
            velocity_m_s=(x / dt, y / dt),
            velocity_std_m_s=(std_x, std_y),
            angular_rad_s=motion.turn_rad / dt,
            angular_std_rad_s=std_turn,
            speed_m_s=length / dt,
            speed_std_m_s=math.sqrt(speed_var) / dt,
        )


ABSTAINED = SlipEstimate(
    (math.nan, math.nan), (math.nan, math.nan), math.nan, math.nan, math.nan, math.nan, abstained=True
)
