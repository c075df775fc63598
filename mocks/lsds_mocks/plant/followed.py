"""Vertical motion of an arm in another process, replayed from its samples."""

from __future__ import annotations

from collections import deque

from lsds.clock import NS_PER_S

SAMPLES_KEPT = 256
"""Number of the newest samples of the arm that are kept; chosen."""
SMOOTHED_S = 0.02
"""Time constant of the low-pass filter on the arm's acceleration, s; chosen."""
BLIND_NS = 20_000_000
"""Time for which the last known velocity extrapolates the motion."""


class FollowedAxis:
    """Replaces `ArmAxis`; position and velocity are upward. `add_sample` supplies samples in order of time.

    Heights count from that of the first sample, which corresponds to the initial position.
    """

    def __init__(self, position_m: float, start_ns: int) -> None:
        self.position_m = position_m
        self.velocity_m_s = 0.0
        self.acceleration_m_s2 = 0.0
        self._start_m = position_m
        self._zero_m: float | None = None
        self._t_ns = start_ns
        self._samples: deque[tuple[int, float, float]] = deque(maxlen=SAMPLES_KEPT)

    def add_sample(self, t_ns: int, height_m: float, velocity_m_s: float) -> None:
        """Add one sample of the arm: height and upward velocity at a time."""
        if self._zero_m is None:
            self._zero_m = height_m
        if not self._samples or t_ns > self._samples[-1][0]:
            self._samples.append((t_ns, height_m - self._zero_m, velocity_m_s))

    def step(self, dt_s: float) -> None:
        """Advance to the next instant of the physics."""
        self._t_ns += round(dt_s * NS_PER_S)
        way = self._at(self._t_ns)
        velocity = (self._start_m + way - self.position_m) / dt_s
        # Second differences are mostly timing noise of the samples, hence the smoothing over some ten milliseconds.
        change = (velocity - self.velocity_m_s) / dt_s
        self.acceleration_m_s2 += (change - self.acceleration_m_s2) * min(1.0, dt_s / SMOOTHED_S)
        self.velocity_m_s = velocity
        self.position_m = self._start_m + way

    def _at(self, t_ns: int) -> float:
        samples = self._samples
        if not samples:
            return 0.0
        while len(samples) > 2 and samples[1][0] <= t_ns:
            samples.popleft()
        t0, z0, v0 = samples[0]
        if len(samples) > 1 and t_ns > t0:
            t1, z1, _ = samples[1]
            if t_ns <= t1:
                return z0 + (z1 - z0) * (t_ns - t0) / (t1 - t0)
            t0, z0, v0 = samples[1]
        # Ahead of the newest sample: extrapolate its velocity for `BLIND_NS`, then hold the position.
        ahead = min(max(t_ns - t0, 0), BLIND_NS)
        return z0 + v0 * ahead / NS_PER_S
