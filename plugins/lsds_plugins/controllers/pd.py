"""Controller `pd`: Algorithm 1 of the paper, with the sign that closes on slip.

    e = severity - target;  de = e - e_prev;  p_new = clamp(p -+ (Kp e + Kd de), 0, 225)   while slip is detected

With p = 0 open and 225 closed the printed minus sign opens the gripper on slip and the object drops; the plus sign is
what the text describes. Gains keep the paper's units (ticks per cm/s, at 25 Hz), so its 3.10 and 0.42 can be used
unchanged; ticks are converted to metres by the stroke. The derivative is scaled to the measured frame interval, starts
at zero, and drops the last error when slip ends.
"""

from __future__ import annotations

import math

from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import BuildContext, GripEstimate, GripTask

#: A tick in the paper: the Hand-E's stroke of 50 mm over 225 ticks. It is only the unit of the gains; the
#: range of the fingers is that of the gripper.
PAPER_TICK_M = 0.05 / 225
#: The frame interval of the paper's derivative gain, s.
NOMINAL_DT_S = 0.04


class PdOptions(BaseModel):
    """Options of `[controller.pd]`."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    kp: float = Field(default=3.10, ge=0, le=1000, description="proportional gain, ticks per cm/s of slip")
    kd: float = Field(default=0.42, ge=0, le=1000, description="derivative gain, ticks per cm/s of change over 0.04 s")
    target_m_s: float = Field(default=0.0, ge=0, le=1, description="slip speed that is not corrected")
    literal_sign: bool = Field(
        default=False, description="use the printed sign, which opens on slip and drops the object"
    )
    release_m_s: float = Field(
        default=0.0, ge=0, le=0.01, description="opening speed while nothing slips; 0: never open, as in the paper"
    )
    release_after_s: float = Field(default=2.0, ge=0, le=600, description="time without slip before the release begins")


class PdController:
    """A `Controller` that closes from the present aperture while slip is detected."""

    limits_force = False

    def __init__(self, options: PdOptions, context: BuildContext) -> None:
        self._options = options
        self.reset()

    @property
    def may_open(self) -> bool:
        """True if these options can open the gripper on purpose; the guard allows opening only then."""
        return self._options.literal_sign or self._options.release_m_s > 0

    def reset(self) -> None:
        """Clear the last error and the time without slip."""
        self._last_error: float | None = None
        self._quiet_s = 0.0
        self._released_to: float | None = None

    def update(self, grip: GripEstimate, wanted: GripTask) -> float | None:
        """Return the new aperture in metres, or None to leave the gripper unchanged."""
        estimate = grip.estimate
        if not grip.detection.slip:
            self._last_error = None
            return self._release(grip)
        self._quiet_s = 0.0
        self._released_to = None
        if estimate.abstained or not math.isfinite(estimate.speed_m_s):
            self._last_error = None
            return None
        target_m_s = max(self._options.target_m_s, 0.0 if wanted.slide is None else wanted.slide.speed_m_s)
        error = 100 * (estimate.speed_m_s - target_m_s)
        change = 0.0 if self._last_error is None else error - self._last_error
        if grip.dt_s > 0:
            change *= NOMINAL_DT_S / grip.dt_s
        self._last_error = error
        ticks = self._options.kp * error + self._options.kd * change
        if self._options.literal_sign:
            ticks = -ticks
        # Start from the measured aperture, as in the paper, not from the last command: while a command is being
        # executed, the same correction is commanded again instead of added, so that delay does not accumulate
        # corrections.
        aperture = grip.measured_m if math.isfinite(grip.measured_m) else grip.commanded_m
        aperture = max(0.0, aperture - PAPER_TICK_M * ticks)
        # A decreasing error, or fingers behind their command, must not open the grip while the object slips.
        return aperture if self._options.literal_sign else min(aperture, grip.commanded_m)

    def _release(self, grip: GripEstimate) -> float | None:
        """Open slowly after a time without slip. Abstention does not count as time without slip, and does not
        release."""
        if grip.detection.slip is None or self._options.release_m_s <= 0 or not grip.dt_s > 0:
            return None
        self._quiet_s += grip.dt_s
        if self._quiet_s < self._options.release_after_s:
            return None
        # The device rounds steps smaller than a tick, so integrate the requested aperture, not the sent one.
        base = grip.commanded_m if self._released_to is None else self._released_to
        self._released_to = base + self._options.release_m_s * grip.dt_s
        return self._released_to
