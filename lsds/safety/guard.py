"""The limits of the cell. They limit the effect of mistakes and are not a safety function.

Nothing here is certified or redundant, and all of it runs on the computer that it monitors. People are protected by the
emergency stop, the arm's own safety configuration and the layout of the cell, never by this module.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts.values import ArmCommand, GripperCommand, Twist
from lsds.errors import LimitExceeded

LEAST_OPENING_M = 3e-4
"""Maximum opening of one automatic correction, m, unless the gripper's tick is larger; chosen."""


class SafetyOptions(BaseModel):
    """Options of the `[safety]` table: limits of the cell, in addition to those of each device."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    max_grip_force_n: float = Field(default=100.0, gt=0, le=500, description="maximum force of the gripper")
    max_finger_speed_m_s: float = Field(default=0.15, gt=0, le=1, description="maximum finger speed")
    max_arm_speed_m_s: float = Field(default=0.1, gt=0, le=2, description="maximum linear TCP speed")
    max_arm_angular_rad_s: float = Field(default=0.5, gt=0, le=10, description="maximum angular TCP speed")
    max_arm_acceleration_m_s2: float = Field(default=1.0, gt=0, le=20, description="maximum TCP acceleration")
    min_aperture_m: float = Field(default=0.0, ge=0, le=0.5, description="minimum aperture")
    max_aperture_m: float | None = Field(default=None, gt=0, le=0.5, description="maximum aperture")
    stale_after_s: float = Field(default=0.2, gt=0, le=10, description="stop if no new frame has arrived for this time")
    frozen_after_s: float = Field(
        default=0.2,
        gt=0,
        le=3600,
        description="stop if the camera repeats an image, or a tenth of it, for this time; not before stale_after_s",
    )
    watch_press: bool = Field(
        default=True, description="stop if the gel does not show the closings that the gripper reports"
    )
    watchdog_s: float = Field(default=0.5, gt=0, le=10, description="stop if the loop is silent for this time")
    command_lifetime_s: float = Field(default=0.1, gt=0, le=10, description="lifetime of a motion command")

    @property
    def apertures_m(self) -> tuple[float, float]:
        """The least and the greatest aperture, m."""
        return self.min_aperture_m, math.inf if self.max_aperture_m is None else self.max_aperture_m


def correction_opens_m(tick_m: float) -> float:
    """Return how far one automatic correction may open a gripper with this tick, m."""
    return max(tick_m, LEAST_OPENING_M)


@dataclass(slots=True)
class GuardCounts:
    """Number of commands that each limit changed."""

    force: int = 0
    finger_speed: int = 0
    aperture: int = 0
    kept_closed: int = 0
    arm_speed: int = 0
    arm_angular: int = 0
    arm_acceleration: int = 0


class Guard:
    """Clamps commands to the cell's limits and counts the changes; refuses NaN and infinity."""

    def __init__(self, options: SafetyOptions) -> None:
        self._options = options
        self.counts = GuardCounts()

    def gripper(self, command: GripperCommand, held_aperture_m: float, *, opens_by_m: float) -> GripperCommand:
        """Return the command clamped to the limits.

        `held_aperture_m` is the aperture last sent to the gripper, `opens_by_m` how far the command may open beyond it.
        An automatic grip correction passes 0 and can then only close, or a tick: a sign error or a bad estimate must
        not release the object. A release requested by the task passes infinity. Raises LimitExceeded if a number is NaN
        or infinite, or if speed or force is negative.
        """
        _require_finite("gripper", command.aperture_m, command.speed_m_s, command.force_n)
        if command.speed_m_s < 0 or command.force_n < 0:
            raise LimitExceeded("gripper", "speed and force are magnitudes and must not be negative")
        limits, counts = self._options, self.counts
        force, changed = _at_most(command.force_n, limits.max_grip_force_n)
        counts.force += changed
        speed, changed = _at_most(command.speed_m_s, limits.max_finger_speed_m_s)
        counts.finger_speed += changed
        aperture = max(command.aperture_m, limits.min_aperture_m)
        if limits.max_aperture_m is not None:
            aperture = min(aperture, limits.max_aperture_m)
        counts.aperture += aperture != command.aperture_m
        if opens_by_m < math.inf:
            _require_finite("gripper", held_aperture_m)
            if aperture > held_aperture_m + opens_by_m:
                aperture = held_aperture_m + opens_by_m
                counts.kept_closed += 1
        return replace(command, aperture_m=aperture, speed_m_s=speed, force_n=force)

    def arm(self, command: ArmCommand) -> ArmCommand:
        """Return the command clamped to the limits; a twist that is too fast keeps its direction.

        Raises LimitExceeded if a number is NaN or infinite, or if the acceleration is not positive.
        """
        twist = command.twist
        _require_finite("arm", *twist.linear_m_s, *twist.angular_rad_s, command.acceleration_m_s2)
        if command.acceleration_m_s2 <= 0:
            raise LimitExceeded("arm", "the acceleration must be positive, otherwise the arm could not come to rest")
        limits, counts = self._options, self.counts
        linear, changed = _scaled(twist.linear_m_s, limits.max_arm_speed_m_s)
        counts.arm_speed += changed
        angular, changed = _scaled(twist.angular_rad_s, limits.max_arm_angular_rad_s)
        counts.arm_angular += changed
        acceleration, changed = _at_most(command.acceleration_m_s2, limits.max_arm_acceleration_m_s2)
        counts.arm_acceleration += changed
        return ArmCommand(Twist(linear, angular), acceleration, command.expires_ns)


def _require_finite(device: str, *numbers: float) -> None:
    if not all(map(math.isfinite, numbers)):
        raise LimitExceeded(device, "a command contained NaN or infinity and was not sent")


def _at_most(value: float, limit: float) -> tuple[float, bool]:
    return (limit, True) if value > limit else (value, False)


def _scaled(vector: tuple[float, float, float], limit: float) -> tuple[tuple[float, float, float], bool]:
    length = math.hypot(*vector)
    if length <= limit:
        return vector, False
    x, y, z = vector
    # Dividing first keeps the product finite for lengths near the largest double.
    return (x / length * limit, y / length * limit, z / length * limit), True
