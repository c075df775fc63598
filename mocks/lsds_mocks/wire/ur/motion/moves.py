"""Moves along paths: to joint positions, along straight lines and arcs, and blends between moves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

from lsds_mocks.wire.ur.motion.profile import Profile, profile, timed_profile
from lsds_mocks.wire.ur.motion.state import ArmMotion, Joints, Step, Unreachable
from lsds_mocks.wire.ur.pose_math import difference, moved, norm

JOINTS_SETTLE_S = 0.03
"""Delay between a move's end at rest and its completion (s): the real controller waits until the joints settle."""

LEVER_M = 0.3
"""Radius that converts a rotation of the tool to a path length (m)."""

_CHECKS = 40
"""Number of equal sections of a path over which the joints' speeds are checked; chosen."""
_JUMP_RAD = 0.35
"""Joint motion in a section, beyond a margin on its speed limit, that makes a path unreachable, rad; chosen."""


class Before(Protocol):
    """A motion that is still in progress when the next one begins."""

    @property
    def end(self) -> Joints:
        """Where it ends."""
        ...

    @property
    def ended(self) -> bool:
        """Whether it has."""
        ...

    def rest(self, dt_s: float) -> Joints:
        """Advance the motion; return its remaining distance per joint."""
        ...


class Coast:
    """The end of a motion without a command: each joint decelerates to rest."""

    def __init__(self, arm: ArmMotion, deceleration: float) -> None:
        self._qd = list(arm.qd)
        self._stop_s = max(map(abs, self._qd)) / deceleration
        self._elapsed_s = 0.0
        self.end = [q + v * self._stop_s / 2 for q, v in zip(arm.q, self._qd, strict=True)]

    @property
    def ended(self) -> bool:
        """Whether all joints are at rest."""
        return self._elapsed_s >= self._stop_s

    def rest(self, dt_s: float) -> Joints:
        """Advance the motion; return its remaining distance per joint."""
        self._elapsed_s = min(self._elapsed_s + dt_s, self._stop_s)
        left = self._stop_s - self._elapsed_s
        return [-v * left * left / (2 * self._stop_s) for v in self._qd]


class PathMove:
    """A move from the present configuration, at rest or blended, along `at(share)` with the timing of a profile.

    While the previous move still brakes (a blend), its remaining distance is added. That rounds the corner, and the end
    is exact once the previous move has ended.
    """

    def __init__(self, arm: ArmMotion, way: Profile, blend_m: float, before: Before | None) -> None:
        self.arm = arm
        self.way = way
        self.elapsed_s = 0.0
        self._before = before
        self._yielded = [0.0] * len(arm.q)
        self._end: Joints | None = None
        self._blend = blend_m
        self._settled_s = way.duration_s + (0.0 if blend_m > 0 else JOINTS_SETTLE_S)

    def at(self, share: float) -> Joints:
        """Return the joints at a fraction (0..1) of the path."""
        raise NotImplementedError

    @property
    def length_m(self) -> float:
        """Length of the tool's path, which blend radii refer to."""
        return self.way.length

    @property
    def done(self) -> bool:
        """Whether the script may continue: the arm is at rest, or the blend begins."""
        if self._blend <= 0:
            return self.elapsed_s >= self._settled_s - 1e-9
        braking = self.elapsed_s >= self.way.duration_s - self.way.ramp_s
        left = (1 - self.way.share(self.elapsed_s)) * self.length_m
        return braking and left <= self._blend

    @property
    def ended(self) -> bool:
        """Whether the move has reached its end."""
        return self.elapsed_s >= self._settled_s - 1e-9

    def step(self, dt_s: float) -> Step:
        """Return the arm after a time step."""
        self.elapsed_s += dt_s
        q = self.at(self.way.share(self.elapsed_s))
        if any(self._yielded):
            q = [a + b for a, b in zip(q, self._yielded, strict=True)]
        if self._before is not None:
            q = [a + b for a, b in zip(q, self._before.rest(dt_s), strict=True)]
            if self._before.ended:
                self._before = None
        return Step(q)

    def shift(self, q: Sequence[float]) -> None:
        """Shift the whole path by joint angles `q`, by which a compliant tool has yielded."""
        self._yielded = [a + b for a, b in zip(self._yielded, q, strict=True)]

    def rest(self, dt_s: float) -> Joints:
        """Advance a move that another one has replaced; return its remaining distance per joint."""
        return [a - b for a, b in zip(self.step(dt_s).q, self.end, strict=True)]

    @property
    def end(self) -> Joints:
        """Where it ends."""
        if self._end is None:
            self._end = self.at(1.0)
        return self._end

    def _keep_within_speed(self, limits: Sequence[float]) -> None:
        """Slow down where the path exceeds a joint's limits."""
        step = 1.0 / _CHECKS
        worst, before = 0.0, self.at(0.0)
        for number in range(1, _CHECKS + 1):
            now = self.at(number * step)
            for a, b, limit in zip(now, before, limits, strict=True):
                if abs(a - b) > _JUMP_RAD + limit * step * max(self.way.duration_s, 0.1) * 4:
                    raise Unreachable(self.arm.tcp(now))
                worst = max(worst, abs(a - b) / step / limit)
            before = now
        self._end = before
        if self.way.length <= 0:
            return
        peak = worst * self.way.acceleration * self.way.ramp_s / self.way.length
        if peak > 1:
            self.way = self.way.stretched(self.way.duration_s * peak)
            self._settled_s = self.way.duration_s + (0.0 if self._blend > 0 else JOINTS_SETTLE_S)


class JointMove(PathMove):
    """Moves all joints in proportion; speed and acceleration apply to the joint with the longest distance."""

    def __init__(
        self,
        arm: ArmMotion,
        target: Sequence[float],
        *,
        speed: float,
        acceleration: float,
        time_s: float = 0.0,
        blend_m: float = 0.0,
        before: Before | None = None,
    ) -> None:
        self._start = before.end if before is not None else list(arm.q)
        self._delta = [b - a for a, b in zip(self._start, target, strict=True)]
        way = _way(max(map(abs, self._delta)), speed, acceleration, time_s)
        tool = (arm.tcp(self._start), arm.tcp(list(target)))
        self._tool_m = norm([b - a for a, b in zip(tool[0][:3], tool[1][:3], strict=True)])
        super().__init__(arm, way, blend_m, before)
        self._keep_within_speed(arm.kinematics.model.joint_speed_rad_s)

    @property
    def length_m(self) -> float:
        """Distance of the tool from start to end."""
        return self._tool_m

    def at(self, share: float) -> Joints:
        """Return the joints at a fraction of the path."""
        return [a + share * d for a, d in zip(self._start, self._delta, strict=True)]


class ToolMove(PathMove):
    """A move along a path of the tool, `pose(share)`; each inverse solution starts from the previous one."""

    def __init__(self, arm: ArmMotion, way: Profile, blend_m: float, before: Before | None, joints: Joints) -> None:
        super().__init__(arm, way, blend_m, before)
        self._near = self._first = joints
        self._keep_within_speed(arm.kinematics.model.joint_speed_rad_s)
        self._near = joints

    def pose(self, share: float) -> Sequence[float]:
        """Return the tool's pose at a fraction (0..1) of the path."""
        raise NotImplementedError

    def at(self, share: float) -> Joints:
        """Return the joints at a fraction of the path. Raises Unreachable."""
        if share <= 0:
            self._near = self._first
            return list(self._first)
        self._near = self.arm.joints(self.pose(share), self._near)
        return list(self._near)


class LineMove(ToolMove):
    """Moves the tool along a straight line, with rotation at a constant rate."""

    def __init__(
        self,
        arm: ArmMotion,
        target: Sequence[float],
        *,
        speed: float,
        acceleration: float,
        time_s: float = 0.0,
        blend_m: float = 0.0,
        before: Before | None = None,
    ) -> None:
        joints = before.end if before is not None else list(arm.q)
        self._start = arm.tcp(joints)
        self._shift, self._turn = difference(self._start, target)
        length = max(norm(self._shift), LEVER_M * norm(self._turn))
        super().__init__(arm, _way(length, speed, acceleration, time_s), blend_m, before, joints)

    def pose(self, share: float) -> Sequence[float]:
        """Return the tool's pose at a fraction of the path."""
        return moved(self._start, self._shift, self._turn, share)


class ArcMove(ToolMove):
    """Moves the tool along the circle through start, via point and target, with rotation at a constant rate."""

    def __init__(
        self,
        arm: ArmMotion,
        via: Sequence[float],
        target: Sequence[float],
        *,
        speed: float,
        acceleration: float,
        blend_m: float = 0.0,
        before: Before | None = None,
        keep_orientation: bool = False,
    ) -> None:
        joints = before.end if before is not None else list(arm.q)
        self._start = arm.tcp(joints)
        self._centre, self._u, self._v, self._angle = _circle(self._start[:3], via[:3], target[:3])
        self._radius = norm(self._u)
        _, turn = difference(self._start, target)
        self._turn = (0.0, 0.0, 0.0) if keep_orientation else turn
        length = max(self._radius * self._angle, LEVER_M * norm(self._turn))
        super().__init__(arm, _way(length, speed, acceleration, 0.0), blend_m, before, joints)

    def pose(self, share: float) -> Sequence[float]:
        """Return the tool's pose at a fraction of the path."""
        c, s = math.cos(share * self._angle), math.sin(share * self._angle)
        point = [m + c * u + s * v for m, u, v in zip(self._centre, self._u, self._v, strict=True)]
        return [*point, *moved(self._start, (0.0, 0.0, 0.0), self._turn, share)[3:]]


def _way(length: float, speed: float, acceleration: float, time_s: float) -> Profile:
    if time_s > 0:
        return timed_profile(length, time_s, acceleration)
    return profile(length, speed, acceleration)


def _circle(a: Sequence[float], b: Sequence[float], c: Sequence[float]) -> tuple[Joints, Joints, Joints, float]:
    """Return centre, two half axes (the first one points to `a`) and the angle from `a` via `b` to `c`."""
    ab, ac = [y - x for x, y in zip(a, b, strict=True)], [y - x for x, y in zip(a, c, strict=True)]
    normal = _cross(ab, ac)
    area = sum(n * n for n in normal)
    if area < 1e-16:
        raise Unreachable([*b, 0, 0, 0])
    ab2, ac2 = sum(x * x for x in ab), sum(x * x for x in ac)
    to_centre = [(ac2 * p + ab2 * q) / (2 * area) for p, q in zip(_cross(normal, ab), _cross(ac, normal), strict=True)]
    centre = [x + t for x, t in zip(a, to_centre, strict=True)]
    u = [-t for t in to_centre]
    unit = [n / math.sqrt(area) for n in normal]
    v = _cross(unit, u)
    end = [x - m for x, m in zip(c, centre, strict=True)]
    angle = math.atan2(sum(p * q for p, q in zip(end, v, strict=True)), sum(p * q for p, q in zip(end, u, strict=True)))
    return centre, u, v, angle % (2 * math.pi)


def _cross(a: Sequence[float], b: Sequence[float]) -> Joints:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
