"""Estimator `imprint`: slip velocity as the motion of the object's imprint against the gel. Nothing is trained.

The imprint's motion since the last frame, divided by the measured interval (`lsds.tactile.imprint`). Along an edge, and
where a smooth object shows nothing, the standard deviation says so. It abstains where the imprint of the last frame is
not found again.
"""

from __future__ import annotations

import math

from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import ABSTAINED, BuildContext, Observation, SlipEstimate
from lsds.tactile.imprint.uncertainty import FAINT_STD_M, GEL_SHARE, Symmetric, variances

Velocity = tuple[float, float, float]
"""Velocity x, y (m/s) and turn (rad/s)."""


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
    still_um: float = Field(
        default=round(FAINT_STD_M * 1e6, 3),
        gt=0,
        le=1000,
        description="how far the imprint trembles where nothing moves",
    )


class ImprintEstimator:
    """An `Estimator` that looks at two frames and keeps no state."""

    def __init__(self, options: ImprintOptions, context: BuildContext) -> None:
        self._options = options

    def reset(self) -> None:
        """Nothing to forget."""

    def update(self, observation: Observation) -> SlipEstimate:
        """Estimate; abstain if the imprint's motion is unknown. Angles are clockwise on the image (x to y)."""
        found = measured(observation, self._options)
        return ABSTAINED if found is None else estimate_of(*found)


def measured(observation: Observation, options: ImprintOptions) -> tuple[Velocity, Symmetric] | None:
    """Return the velocity (x, y in m/s, turn in rad/s) of the imprint against the gel and its covariance.

    None if the imprint's motion is unknown.
    """
    motion = None if observation.imprint is None else observation.imprint()
    dt = observation.dt_s
    if motion is None or not dt > 0 or motion.match < options.least_match:
        return None
    x, y = motion.slip_m
    per = 1 / dt**2
    xx, xy, xt, yy, yt, tt = variances(motion, options.gel_share, options.still_um * 1e-6)
    return (x / dt, y / dt, motion.turn_rad / dt), (per * xx, per * xy, per * xt, per * yy, per * yt, per * tt)


def estimate_of(velocity: Velocity, spread: Symmetric) -> SlipEstimate:
    """Return the estimate of a velocity (x, y in m/s, turn in rad/s) with its covariance."""
    x, y, turn = velocity
    xx, xy, _, yy, _, tt = spread
    speed = math.hypot(x, y)
    # The speed's variance is that along the motion; at rest, the mean over all directions.
    variance = (x * x * xx + 2 * x * y * xy + y * y * yy) / speed**2 if speed > 0 else (xx + yy) / 2
    return SlipEstimate((x, y), (_root(xx), _root(yy)), turn, _root(tt), speed, _root(variance))


def _root(variance: float) -> float:
    """Return a standard deviation; rounding may make a variance negative."""
    return math.sqrt(max(variance, 0.0))
