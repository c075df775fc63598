"""Kinematic axes: the arm's vertical velocity loop and the gripper's position drive."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class ArmAxis:
    """Vertical TCP motion that follows a velocity with a bounded acceleration. Position and velocity upward."""

    position_m: float
    velocity_m_s: float = 0.0
    acceleration_m_s2: float = 0.0
    target_m_s: float = 0.0
    limit_m_s2: float = 1.2

    def step(self, dt_s: float) -> None:
        """Advance; the position integrates the velocity at the step's end, as the friction step does."""
        change = min(max(self.target_m_s - self.velocity_m_s, -self.limit_m_s2 * dt_s), self.limit_m_s2 * dt_s)
        self.velocity_m_s += change
        self.acceleration_m_s2 = change / dt_s
        self.position_m += dt_s * self.velocity_m_s


@dataclass(slots=True)
class FingerDrive:
    """The fingers' drive: moves to an aperture at a speed and stalls when closing needs more than the force limit."""

    aperture_m: float
    target_m: float
    speed_m_s: float = 0.05
    limit_n: float = 60.0
    moving: bool = False
    stalled: bool = False

    def step(self, dt_s: float, force_n: float) -> None:
        """Advance against the present normal force of one finger; a stalled drive holds its position."""
        left = self.target_m - self.aperture_m
        self.stalled = left < 0 and force_n >= self.limit_n
        self.moving = left != 0 and not self.stalled
        if not self.moving:
            return
        reach = self.speed_m_s * dt_s
        if abs(left) <= reach:
            self.aperture_m = self.target_m
        else:
            self.aperture_m += reach if left > 0 else -reach
