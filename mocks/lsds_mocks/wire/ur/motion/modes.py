"""Modes that follow a command in each cycle: joint speed, tool speed, servo, and stopping."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from lsds_mocks.wire.ur.kinematics import JOINTS
from lsds_mocks.wire.ur.motion.state import ArmMotion, Joints, Step

_DAMPING = 1e-2
"""Damping factor of the least squares that replace the inverse Jacobian near a singularity; chosen."""
_NEAR_SINGULAR = 3.0
"""Ratio of a joint's speed to its limit above which the arm counts as near a singularity; chosen."""


class SpeedMode:
    """Accelerates the joints to speeds `qd` (rad/s); done after `time_s` or, without a time, at those speeds.

    It works in the script's time, which the speed slider stretches; `arm.qd` is in that time, too.
    """

    def __init__(self, arm: ArmMotion, qd: Sequence[float], acceleration: float, time_s: float) -> None:
        self.arm = arm
        self.elapsed_s = 0.0
        self._target = list(qd)
        self._time_s = time_s
        self._from = list(arm.qd)
        change = [b - a for a, b in zip(self._from, self._target, strict=True)]
        largest = max(map(abs, change))
        self._ramp_s = largest / max(acceleration, 1e-6)
        # Fixed here, so that the acceleration is constant over the ramp.
        self._qdd = [acceleration * c / largest for c in change] if largest > 0 else [0.0] * JOINTS

    @property
    def done(self) -> bool:
        """Whether the script may go on."""
        return self.elapsed_s >= (self._time_s if self._time_s > 0 else self._ramp_s) - 1e-9

    def step(self, dt_s: float) -> Step:
        """Return the arm after a time step."""
        ramping = self.elapsed_s < self._ramp_s - 1e-9
        self.elapsed_s += dt_s
        if self.elapsed_s >= self._ramp_s - 1e-9:
            qd = self._target
        else:
            qd = [a + self.elapsed_s * b for a, b in zip(self._from, self._qdd, strict=True)]
        return Step([q + v * dt_s for q, v in zip(self.arm.q, qd, strict=True)], qd, self._qdd if ramping else None)


class ToolSpeedMode:
    """Accelerates the tool (m/s2) to a velocity (m/s, rad/s, base frame)."""

    def __init__(self, arm: ArmMotion, xd: Sequence[float], acceleration: float, time_s: float) -> None:
        self.arm = arm
        self.elapsed_s = 0.0
        self._acceleration = acceleration
        self._time_s = time_s
        self._reached = False
        self._xd = np.array(xd, dtype=float)
        self._now = tool_velocity(arm)

    @property
    def done(self) -> bool:
        """Whether the script may go on."""
        return self.elapsed_s >= self._time_s - 1e-9 if self._time_s > 0 else self._reached

    def step(self, dt_s: float) -> Step:
        """Return the arm after a time step."""
        self.elapsed_s += dt_s
        change = self._xd - self._now
        size = max(float(np.linalg.norm(change[:3])), 0.3 * float(np.linalg.norm(change[3:])))
        share = 1.0 if size <= self._acceleration * dt_s else self._acceleration * dt_s / size
        self._reached = share >= 1.0
        self._now = self._now + share * change
        qd = joint_speeds(self.arm, self._now)
        return Step([q + v * dt_s for q, v in zip(self.arm.q, qd, strict=True)], qd)


class ServoMode:
    """Follows a joint target that is updated every few milliseconds, through a critically damped filter.

    Its time constant is the look-ahead time, shorter at a higher gain (300 is the controller's default).
    """

    def __init__(self, arm: ArmMotion, target: Sequence[float], time_s: float, lookahead_s: float, gain: float) -> None:
        self.arm = arm
        self.elapsed_s = 0.0
        self._target = list(target)
        self._time_s = max(time_s, 0.002)
        self._rate = 2.0 / max(lookahead_s * math.sqrt(300.0 / max(gain, 100.0)), 0.01)

    @property
    def done(self) -> bool:
        """Whether the script may go on."""
        return self.elapsed_s >= self._time_s - 1e-9

    def step(self, dt_s: float) -> Step:
        """Return the arm after a time step; exact for the filter and therefore stable at any gain."""
        self.elapsed_s += dt_s
        w, decay = self._rate, math.exp(-self._rate * dt_s)
        limits = self.arm.kinematics.model.joint_speed_rad_s
        q, qd = [], []
        for at, speed, target, limit in zip(self.arm.q, self.arm.qd, self._target, limits, strict=True):
            off = at - target
            pull = speed + w * off
            way = target + decay * (off + pull * dt_s) - at
            if abs(way) > limit * dt_s:
                way = math.copysign(limit * dt_s, way)
                qd.append(way / dt_s)
            else:
                qd.append(decay * (speed - w * pull * dt_s))
            q.append(at + way)
        return Step(q, qd)


class StopJoints:
    """Brings all joints to rest in the same time."""

    def __init__(self, arm: ArmMotion, deceleration: float) -> None:
        self.arm = arm
        self._deceleration = max(deceleration, 0.01)

    @property
    def done(self) -> bool:
        """Whether the arm is at rest."""
        return not self.arm.moving

    def step(self, dt_s: float) -> Step:
        """Return the arm after a time step."""
        largest = max(map(abs, self.arm.qd))
        left = 0.0 if largest <= self._deceleration * dt_s else 1 - self._deceleration * dt_s / largest
        qd = [v * left for v in self.arm.qd]
        return Step([q + v * dt_s for q, v in zip(self.arm.q, qd, strict=True)], qd)


class StopTool(StopJoints):
    """Brings the tool to rest on a straight line, as long as that is possible."""

    def step(self, dt_s: float) -> Step:
        """Return the arm after a time step."""
        speed = tool_velocity(self.arm)
        size = float(np.linalg.norm(speed[:3]))
        if size < 1e-4:
            return StopJoints(self.arm, max(self._deceleration, 5.0)).step(dt_s)
        left = max(0.0, 1 - self._deceleration * dt_s / size)
        qd = joint_speeds(self.arm, speed * left) if left > 0 else [0.0] * JOINTS
        return Step([q + v * dt_s for q, v in zip(self.arm.q, qd, strict=True)], qd)


def tool_velocity(arm: ArmMotion) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return the TCP's velocity (m/s) and angular velocity (rad/s) in the base frame."""
    velocity: np.ndarray[tuple[int], np.dtype[np.float64]] = arm.kinematics.jacobian(arm.q, arm.tcp()[:3]) @ arm.qd
    return velocity


def joint_speeds(arm: ArmMotion, xd: np.ndarray[tuple[int], np.dtype[np.float64]]) -> Joints:
    """Return joint speeds for a tool velocity, damped near singularities and scaled down to the joints' limits."""
    jacobian = arm.kinematics.jacobian(arm.q, arm.tcp()[:3])
    limits = arm.kinematics.model.joint_speed_rad_s
    try:
        qd = np.linalg.solve(jacobian, xd)
        worst = float(np.max(np.abs(qd) / limits))
    except np.linalg.LinAlgError:
        qd, worst = np.zeros(JOINTS), math.inf
    if worst > _NEAR_SINGULAR:
        qd = np.linalg.solve(jacobian.T @ jacobian + _DAMPING**2 * np.eye(JOINTS), jacobian.T @ xd)
        worst = float(np.max(np.abs(qd) / limits))
    worst = max(1.0, worst)
    speeds: Joints = (qd / worst).tolist()
    return speeds
