"""Execution of a script's present move, one control cycle at a time; the only code that changes the arm's joints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lsds_mocks.wire.ur.kinematics import JOINT_LIMIT_RAD, JOINTS
from lsds_mocks.wire.ur.motion.modes import StopJoints, joint_speeds
from lsds_mocks.wire.ur.motion.moves import Before, Coast, PathMove
from lsds_mocks.wire.ur.motion.state import ArmMotion, Joints, Move, Step

BRAKE_RAD_S2 = 10.0
"""Deceleration of a motion that its script has dropped (rad/s2)."""


class Compliance:
    """Force mode: along selected axes of a frame the tool yields until the measured force is the requested one.

    `wrench` is the load that the tool has to exert (N, Nm), `limits` its maximum speeds (m/s, rad/s).
    """

    def __init__(
        self,
        frame: Sequence[Sequence[float]],
        selection: Sequence[int],
        wrench: Sequence[float],
        limits: Sequence[float],
    ) -> None:
        turn = np.array(frame, dtype=float)
        self._axes = np.block([[turn, np.zeros((3, 3))], [np.zeros((3, 3)), turn]])
        self._selection = np.array(selection, dtype=bool)
        self._wrench = np.array(wrench, dtype=float)
        self._limits = np.abs(np.array(limits, dtype=float))

    def velocity(self, felt: Sequence[float], gain: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """Return the tool's velocity in the base frame; `felt` is the force on the tool there."""
        # The requested force plus that of the environment moves the tool.
        push = self._wrench + self._axes.T @ np.array(felt, dtype=float)
        scale = gain * np.array([1e-3, 1e-3, 1e-3, 2e-2, 2e-2, 2e-2])
        free = np.where(self._selection, np.clip(push * scale, -self._limits, self._limits), 0.0)
        velocity: np.ndarray[tuple[int], np.dtype[np.float64]] = self._axes @ free
        return velocity


class Motion:
    """Owner of the arm's joints. A script starts a move and polls whether it is done; the arm brakes if the script
    drops the move."""

    def __init__(self, arm: ArmMotion) -> None:
        self.arm = arm
        self.compliance: Compliance | None = None
        self.compliance_gain = 1.0
        self._move: Move | None = None
        self._driven = False

    @property
    def before(self) -> Before | None:
        """The motion that the next path move blends with: a move with a blend radius, or remaining speed."""
        if isinstance(self._move, PathMove) and self._move.done and not self._move.ended:
            return self._move
        return Coast(self.arm, BRAKE_RAD_S2) if self.arm.moving else None

    @property
    def steady(self) -> bool:
        """Whether the arm is at rest and no move is in progress."""
        return not self.arm.moving and (self._move is None or not self._driven)

    def start(self, move: Move) -> None:
        """Start a move, which replaces the present one."""
        self._move, self._driven = move, True

    def drop(self, move: Move) -> None:
        """Drop this move. A path move that the next move already blends with still runs to its end."""
        if self._move is move:
            self._driven = isinstance(move, PathMove) and move.done

    def drop_all(self) -> None:
        """Drop all moves and end all waiting."""
        self._driven = False
        self.compliance = None

    def freeze(self) -> None:
        """Stop at once, as with the brakes on."""
        self._move, self._driven, self.compliance = None, False, None
        self.arm.qd, self.arm.qdd = [0.0] * JOINTS, [0.0] * JOINTS

    def step(self, dt_s: float, felt: Sequence[float]) -> None:
        """Advance by one control cycle in the script's time.

        Raises Unreachable if the path leaves the arm's reach or exceeds a joint's limit.
        """
        if dt_s <= 0:
            return
        arm, move = self.arm, self._move
        if move is not None and self._driven:
            step = move.step(dt_s)
        elif arm.moving:
            self._move = None
            step = StopJoints(arm, BRAKE_RAD_S2).step(dt_s)
        else:
            self._move = None
            if self.compliance is None:
                if any(arm.qdd):
                    arm.qdd = [0.0] * JOINTS
                return
            step = Step(arm.q, [0.0] * JOINTS, [0.0] * JOINTS)
        if self.compliance is not None:
            step = self._yielding(step, dt_s, felt)
        self._take(step, dt_s)
        if isinstance(move, PathMove) and move.ended and self._move is move:
            self._move = None
            arm.qd, arm.qdd = [0.0] * JOINTS, [0.0] * JOINTS

    def _yielding(self, step: Step, dt_s: float, felt: Sequence[float]) -> Step:
        assert self.compliance is not None
        extra = joint_speeds(self.arm, self.compliance.velocity(felt, self.compliance_gain))
        if isinstance(self._move, PathMove):
            self._move.shift([v * dt_s for v in extra])
        own = step.qd if step.qd is not None else _rates(self.arm.q, step.q, dt_s)
        if self._move is None:
            own = [0.0] * JOINTS
        qd = [a + b for a, b in zip(own, extra, strict=True)]
        return Step([q + v * dt_s for q, v in zip(self.arm.q, qd, strict=True)], qd)

    def _take(self, step: Step, dt_s: float) -> None:
        arm = self.arm
        # This form rejects NaN, too, which would otherwise stay in the joints permanently.
        if not all(abs(q) <= JOINT_LIMIT_RAD + 1e-9 for q in step.q):
            raise JointLimit([round(q, 4) for q in step.q])
        qd = step.qd if step.qd is not None else _rates(arm.q, step.q, dt_s)
        arm.qdd = step.qdd if step.qdd is not None else _rates(arm.qd, qd, dt_s)
        arm.q, arm.qd = list(step.q), list(qd)


class JointLimit(Exception):
    """A joint would leave its range."""

    def __init__(self, q: Joints) -> None:
        super().__init__(f"a joint would leave its range: {q}")


def _rates(before: Sequence[float], after: Sequence[float], dt_s: float) -> Joints:
    return [(b - a) / dt_s for a, b in zip(before, after, strict=True)]
