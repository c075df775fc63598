"""Estimator `field`: linear and angular slip velocity by regression on the field over a short window.

In each frame the markers on the contact are fitted with the best rigid motion: translation, rotation, and a residual.
A gel that is carried along by a sticking object moves rigidly. One that is dragged under a sliding object does not:
each marker catches and lets go as the surface passes under it, the more often the faster it passes, so the residual
grows in proportion to sliding speed. That gives the magnitude, up to a gain that depends on surface and gel and is
known to a factor only; the uncertainty says so. The direction is that of the shear which friction holds up, and the
share of rotation is the rotation's share of the motion over the window.

Untrained but for the gain, which was measured on the simulated cell (`python -m lsds.study.field_gain`).
"""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import BuildContext, Observation, SlipEstimate
from lsds.tactile.contact_markers import markers_in_contact
from lsds.tactile.motion_fit import fit_rigid


class FieldOptions(BaseModel):
    """Options of `[estimator.field]`."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    frames: int = Field(default=3, ge=1, le=100, description="frames in the window")
    gain: float = Field(default=50.0, gt=0, le=1e4, description="sliding speed per RMS residual velocity (simulated)")
    gain_log_std: float = Field(default=0.67, ge=0, le=3, description="one sigma of the gain's logarithm (simulated)")
    jitter_um: float = Field(
        default=0.7, ge=0, le=100, description="RMS error of one marker along one axis; its share is taken off"
    )
    least_markers: int = Field(default=6, ge=3, le=1000, description="fewer valid markers than this: abstain")


class _Moment(NamedTuple):
    """One frame: mean squares (m/s)^2 of residual, translation and rotation, the jitter's part, and the shear held."""

    residual: float
    jitter: float
    translation: float
    rotation: float
    markers: int
    shear_x: float
    shear_y: float
    twist: float
    radius: float


class FieldEstimator:
    """An `Estimator` with a short window of rigid fits."""

    def __init__(self, options: FieldOptions, context: BuildContext) -> None:
        self._options = options
        # A lognormal factor's relative standard deviation.
        self._relative_std = math.sqrt(math.expm1(options.gain_log_std**2))
        self.reset()

    def reset(self) -> None:
        """Forget the window."""
        self._window: deque[_Moment] = deque(maxlen=self._options.frames)

    def update(self, observation: Observation) -> SlipEstimate:
        """Estimate; abstain with too few markers or no velocity. Angles turn clockwise on the image (x to y)."""
        moment = self._fit(observation)
        if moment is None:
            self._window.clear()
            return _ABSTAINED
        window = self._window
        window.append(moment)
        count = len(window)
        jitter = sum(m.jitter for m in window) / count
        residual = sum(m.residual for m in window) / count
        total = self._options.gain * math.sqrt(max(0.0, residual - jitter))
        # What jitter alone lets the mean square scatter by, in units of speed.
        degrees = sum(2 * m.markers - 3 for m in window)
        floor = self._options.gain * math.sqrt(jitter * math.sqrt(2 / degrees)) if degrees > 0 else math.inf
        translation = sum(m.translation for m in window)
        rotation = sum(m.rotation for m in window)
        share = rotation / (translation + rotation) if translation + rotation > 0 else 0.0
        speed, rim_speed = total * math.sqrt(1 - share), total * math.sqrt(share)
        shear_x, shear_y = sum(m.shear_x for m in window), sum(m.shear_y for m in window)
        length = math.hypot(shear_x, shear_y)
        along_x, along_y = (shear_x / length, shear_y / length) if length > 0 else (0.0, 0.0)
        turn = math.copysign(1.0, sum(m.twist for m in window))
        std = math.hypot(self._relative_std * speed, floor)
        angular_std = math.hypot(self._relative_std * rim_speed, floor) / moment.radius
        return SlipEstimate(
            velocity_m_s=(speed * along_x, speed * along_y),
            # Along the slide the gain is uncertain, across it only the floor is.
            velocity_std_m_s=(
                math.hypot(self._relative_std * speed * along_x, floor),
                math.hypot(self._relative_std * speed * along_y, floor),
            ),
            angular_rad_s=turn * rim_speed / moment.radius,
            angular_std_rad_s=angular_std,
            speed_m_s=speed,
            speed_std_m_s=std,
        )

    def _fit(self, observation: Observation) -> _Moment | None:
        field = observation.field
        chosen = markers_in_contact(observation, self._options.least_markers) & np.isfinite(field.velocity_m_s[:, 0])
        count = int(np.count_nonzero(chosen))
        if count < self._options.least_markers:
            return None
        position = field.position_m[chosen]
        motion = fit_rigid(position, field.velocity_m_s[chosen])
        if motion is None:
            return None
        offset = position - motion.centre
        displacement = field.displacement_m[chosen]
        shear_x, shear_y = displacement.mean(axis=0).tolist()
        inertia = float(np.einsum("ni,ni->", offset, offset))
        torque = float(offset[:, 0] @ displacement[:, 1] - offset[:, 1] @ displacement[:, 0])
        radius = math.sqrt(inertia / count)
        v_x, v_y = motion.translation.tolist()
        # Velocity differences carry the error of two frames, in two axes.
        jitter = 4 * (self._options.jitter_um * 1e-6 / observation.dt_s) ** 2
        return _Moment(
            float(np.einsum("ni,ni->", motion.residual, motion.residual)) / count,
            jitter,
            v_x * v_x + v_y * v_y,
            (radius * motion.rotation) ** 2,
            count,
            shear_x,
            shear_y,
            torque / inertia,
            radius,
        )


_NAN = math.nan
_ABSTAINED = SlipEstimate((_NAN, _NAN), (_NAN, _NAN), _NAN, _NAN, _NAN, _NAN, abstained=True)
