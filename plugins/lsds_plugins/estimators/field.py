"""Estimator `field`: linear and angular slip velocity by regression on the field over a short window.

Each frame's velocities are regressed on a smooth motion; the residual along the shear is the signature of slip
(`lsds.tactile.slip_residual`). Markers stick and release more often when the surface slides faster, so the residual,
averaged over the window, is proportional to the slip speed. The gain depends on surface and gel and is known only to a
factor, which the standard deviation includes. The direction is that of the shear carried by friction; the share of
rotation is its share of the rigid motion over the window.

Only the gain is fitted, on the simulated cell (`python -m lsds_research.studies.field_gain`).
"""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import ABSTAINED, BuildContext, Observation, SlipEstimate
from lsds.tactile.slip_residual import Motion, SlipResidual, slip_residual

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class FieldOptions(BaseModel):
    """Options of `[estimator.field]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    frames: int = Field(default=2, ge=1, le=100, description="frames in the window")
    gain: float = Field(
        default=100.0, gt=0, le=1e4, description="slip speed per RMS residual velocity (fitted in simulation)"
    )
    gain_log_std: float = Field(
        default=0.65, ge=0, le=3, description="standard deviation of the gain's logarithm (fitted in simulation)"
    )
    motion: Motion = Field(default="quadratic", description="motion model that counts as sticking")
    least_markers: int = Field(
        default=6, ge=4, le=1000, description="minimum number of valid markers; with fewer it abstains"
    )


class FieldEstimator:
    """An `Estimator` with a short window of residuals."""

    def __init__(self, options: FieldOptions, context: BuildContext) -> None:
        self._options = options
        # A lognormal factor's relative standard deviation.
        self._relative_std = math.sqrt(math.expm1(options.gain_log_std**2))
        self.reset()

    def reset(self) -> None:
        """Clear the window."""
        self._window: deque[SlipResidual] = deque(maxlen=self._options.frames)

    def update(self, observation: Observation) -> SlipEstimate:
        """Estimate; abstain with too few markers or no velocity. Angles turn clockwise on the image (x to y)."""
        evidence = slip_residual(observation, self._options.motion, self._options.least_markers)
        if evidence is None:
            self._window.clear()
            return ABSTAINED
        window = self._window
        window.append(evidence)
        gain, count = self._options.gain, len(window)
        along = sum(e.along for e in window) / count
        across = sum(e.across for e in window) / count
        total = gain * math.sqrt(max(0.0, along - across))
        # Without slip both mean squares are due to jitter, and their difference has this standard deviation.
        floor = gain * math.sqrt(across) * (2 / sum(e.markers for e in window)) ** 0.25
        translation, rim = sum(e.translation for e in window), sum(e.rim for e in window)
        share = rim / (translation + rim) if translation + rim > 0 else 0.0
        speed, rim_speed = total * math.sqrt(1 - share), total * math.sqrt(share)
        shear_x, shear_y = sum(e.shear_m[0] for e in window), sum(e.shear_m[1] for e in window)
        length = math.hypot(shear_x, shear_y)
        along_x, along_y = (shear_x / length, shear_y / length) if length > 0 else (0.0, 0.0)
        # Along the slide the gain is uncertain; across it only the floor is.
        spread = self._relative_std * speed
        return SlipEstimate(
            velocity_m_s=(speed * along_x, speed * along_y),
            velocity_std_m_s=(math.hypot(spread * along_x, floor), math.hypot(spread * along_y, floor)),
            angular_rad_s=math.copysign(rim_speed, sum(e.twist_rad for e in window)) / evidence.radius_m,
            angular_std_rad_s=math.hypot(self._relative_std * rim_speed, floor) / evidence.radius_m,
            speed_m_s=speed,
            speed_std_m_s=math.hypot(spread, floor),
        )


def speed_of(windows: NDArray[np.float32], gain: float) -> NDArray[np.float64]:
    """Return the slip speed (n,) in m/s that `FieldEstimator` estimates for windows (n, frames, 4) of the signals
    residual_along, residual_across, rigid_speed and rim_speed."""
    along, across, rigid, rim = (windows.astype(float) ** 2).mean(axis=1).T
    total = gain * (along - across).clip(0.0) ** 0.5
    share = rim / (rigid + rim).clip(1e-300)
    speed: NDArray[np.float64] = total * (1 - share) ** 0.5
    return speed
