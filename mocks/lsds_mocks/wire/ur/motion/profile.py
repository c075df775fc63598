"""Trapezoidal profiles: from rest to rest over a length, with limited speed and acceleration."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Profile:
    """Covers `length` (rad or m) in `duration_s`: acceleration for `ramp_s`, cruise, deceleration for `ramp_s`."""

    length: float
    acceleration: float
    ramp_s: float
    duration_s: float

    def share(self, t_s: float) -> float:
        """Return the fraction (0..1) of the length that is covered at a time."""
        if self.length <= 0 or t_s >= self.duration_s:
            return 1.0
        if t_s <= 0:
            return 0.0
        a, ramp = self.acceleration, self.ramp_s
        if t_s < ramp:
            done = a * t_s * t_s / 2
        elif t_s <= self.duration_s - ramp:
            done = a * ramp * (t_s - ramp / 2)
        else:
            left = self.duration_s - t_s
            done = self.length - a * left * left / 2
        return done / self.length

    def stretched(self, duration_s: float) -> Profile:
        """Return the same motion with another duration."""
        if self.duration_s <= 0:
            return Profile(self.length, self.acceleration, self.ramp_s, duration_s)
        slower = duration_s / self.duration_s
        return Profile(self.length, self.acceleration / slower**2, self.ramp_s * slower, duration_s)


def profile(length: float, speed: float, acceleration: float) -> Profile:
    """Return the fastest profile within a speed and an acceleration."""
    if length <= 0:
        return Profile(0.0, acceleration, 0.0, 0.0)
    ramp = speed / acceleration
    if acceleration * ramp * ramp > length:
        ramp = math.sqrt(length / acceleration)
        return Profile(length, acceleration, ramp, 2 * ramp)
    return Profile(length, acceleration, ramp, ramp + length / speed)


def timed_profile(length: float, duration_s: float, acceleration: float) -> Profile:
    """Return the profile of a given duration, with the given acceleration or, if that is too low, a higher one."""
    if length <= 0:
        return Profile(0.0, acceleration, 0.0, duration_s)
    square = (acceleration * duration_s) ** 2 - 4 * acceleration * length
    if square <= 0:
        return Profile(length, 4 * length / duration_s**2, duration_s / 2, duration_s)
    speed = (acceleration * duration_s - math.sqrt(square)) / 2
    return Profile(length, acceleration, speed / acceleration, duration_s)
