"""Velocity from poses: exponentially smoothed differences, with the lag of the smoothing."""

from __future__ import annotations

import math
from typing import NamedTuple

from lsds.clock import nanoseconds, seconds
from lsds.contracts.values import Vector3


class Motion(NamedTuple):
    """A smoothed velocity (m/s), valid at `t_ns`, which is `lag_s` before the newest sample."""

    t_ns: int
    velocity_m_s: Vector3
    lag_s: float


class PoseVelocity:
    """Smooths with a time constant; `update` once per sample, in order of time.

    Each difference is the mean velocity of its interval, so it belongs to the interval's middle; the smoothed value is
    a weighted mean of differences, and its lag is the same weighted mean of their ages. For a steady rate that is close
    to the time constant itself. After a gap longer than `gap_s` (the body was out of sight) it starts again.
    """

    def __init__(self, time_constant_s: float = 0.03, gap_s: float = 0.25) -> None:
        self._tau_s = time_constant_s
        self._gap_s = gap_s
        self.reset()

    def reset(self) -> None:
        """Clear the state."""
        self._last: tuple[int, Vector3] | None = None
        self._velocity: Vector3 | None = None
        self._lag_s = 0.0

    def update(self, t_ns: int, position_m: Vector3) -> Motion | None:
        """Add a sample; return the velocity, None until there are two. A sample that is not newer is ignored."""
        last, self._last = self._last, (t_ns, position_m)
        if last is None:
            return None
        dt_s = seconds(t_ns - last[0])
        if dt_s <= 0:
            self._last = last
            return self._motion(last[0])
        if dt_s > self._gap_s:
            self._velocity = None
            return None
        x, y, z = ((now - before) / dt_s for now, before in zip(position_m, last[1], strict=True))
        if self._velocity is None:
            self._velocity, self._lag_s = (x, y, z), dt_s / 2
        else:
            new = 1.0 - math.exp(-dt_s / self._tau_s) if self._tau_s > 0 else 1.0
            old = 1.0 - new
            vx, vy, vz = self._velocity
            self._velocity = (old * vx + new * x, old * vy + new * y, old * vz + new * z)
            self._lag_s = old * (self._lag_s + dt_s) + new * dt_s / 2
        return self._motion(t_ns)

    def _motion(self, t_ns: int) -> Motion | None:
        if self._velocity is None:
            return None
        return Motion(t_ns - nanoseconds(self._lag_s), self._velocity, self._lag_s)
