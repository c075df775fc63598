"""Estimator `imprint`: slip velocity as the motion of the object's imprint against the gel. Nothing is trained.

The imprint's motion since the last frame, divided by the measured interval (`lsds.tactile.imprint`). Along an edge, and
where a smooth object shows nothing, the standard deviation says so. It abstains where the imprint of the last frame is
not found again.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import ABSTAINED, BuildContext, Observation, SlipEstimate
from lsds.tactile.imprint.uncertainty import FAINT_STD_M, GEL_SHARE, covariance

if TYPE_CHECKING:
    from numpy.typing import NDArray


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


def measured(
    observation: Observation, options: ImprintOptions
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Return the velocity (x, y in m/s, turn in rad/s) of the imprint against the gel and its covariance (3, 3).

    None if the imprint's motion is unknown.
    """
    motion = None if observation.imprint is None else observation.imprint()
    dt = observation.dt_s
    if motion is None or not dt > 0 or motion.match < options.least_match:
        return None
    velocity = np.array([*motion.slip_m, motion.turn_rad]) / dt
    return velocity, covariance(motion, options.gel_share, options.still_um * 1e-6) / dt**2


def estimate_of(velocity: NDArray[np.float64], spread: NDArray[np.float64]) -> SlipEstimate:
    """Return the estimate of a velocity (x, y in m/s, turn in rad/s) with its covariance (3, 3)."""
    x, y, turn = velocity.tolist()
    std_x, std_y, std_turn = np.sqrt(np.diag(spread)).tolist()
    speed = math.hypot(x, y)
    # The speed's variance is that along the motion; at rest, the mean over all directions.
    along = velocity[:2] / speed if speed > 0 else None
    variance = (spread[0, 0] + spread[1, 1]) / 2 if along is None else float(along @ spread[:2, :2] @ along)
    return SlipEstimate((x, y), (std_x, std_y), turn, std_turn, speed, math.sqrt(variance))
