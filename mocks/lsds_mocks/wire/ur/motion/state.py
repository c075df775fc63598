"""The state used by moves: joints, tool and limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from lsds_mocks.wire.ur.kinematics import JOINTS, Kinematics
from lsds_mocks.wire.ur.pose_math import compose, inverse

Joints = list[float]


class Step(NamedTuple):
    """Joints after a time step; with speeds and accelerations if the move has better values than differences."""

    q: Joints
    qd: Joints | None = None
    qdd: Joints | None = None


class Move(Protocol):
    """A motion of the arm. It works in the script's time, which the speed slider stretches."""

    @property
    def done(self) -> bool:
        """Whether the calling script may continue."""
        ...

    def step(self, dt_s: float) -> Step:
        """Return the arm after a time step. Raises Unreachable."""
        ...


class Unreachable(Exception):
    """A target, or a point on the path to it, is out of reach; `pose` is that point."""

    def __init__(self, pose: Sequence[float]) -> None:
        super().__init__("out of reach: " + ", ".join(f"{value:.3f}" for value in pose))
        self.pose = list(pose)


@dataclass(slots=True)
class ArmMotion:
    """Positions (rad), speeds and accelerations of the joints, and the tool's offset on the flange."""

    kinematics: Kinematics
    q: Joints
    qd: Joints = field(default_factory=lambda: [0.0] * JOINTS)
    qdd: Joints = field(default_factory=lambda: [0.0] * JOINTS)
    tcp_offset: list[float] = field(default_factory=lambda: [0.0] * JOINTS)

    def tcp(self, q: Sequence[float] | None = None) -> list[float]:
        """Return the TCP pose of a configuration, by default the present one."""
        return self.kinematics.tcp(self.q if q is None else q, self.tcp_offset)

    def joints(self, tcp_pose: Sequence[float], near: Sequence[float]) -> Joints:
        """Return the joints for a TCP pose, nearest to a configuration. Raises Unreachable."""
        flange = compose(tcp_pose, inverse(self.tcp_offset)) if any(self.tcp_offset) else tcp_pose
        q = self.kinematics.inverse(flange, near)
        if q is None:
            raise Unreachable(tcp_pose)
        return q

    @property
    def moving(self) -> bool:
        """Whether any joint moves."""
        return any(self.qd)
