"""Script functions that move the arm, with the names and parameters of the script language."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lsds_mocks.wire.ur.controller import PATH_CHECK
from lsds_mocks.wire.ur.kinematics import JOINT_LIMIT_RAD
from lsds_mocks.wire.ur.motion.modes import ServoMode, SpeedMode, StopJoints, StopTool, ToolSpeedMode
from lsds_mocks.wire.ur.motion.motion import Compliance
from lsds_mocks.wire.ur.motion.moves import ArcMove, JointMove, LineMove, PathMove
from lsds_mocks.wire.ur.motion.state import ArmMotion, Move, Unreachable
from lsds_mocks.wire.ur.pose_math import rotation_of
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.script.program import Waiting
from lsds_mocks.wire.ur.script.values import Pose
from lsds_mocks.wire.ur.targets import not_negative, numbers, positive, target_of

if TYPE_CHECKING:
    from lsds_mocks.wire.ur.controller import Controller

_TOOL_CONTACT_N = 5.0
"""Force on the tool above which `tool_contact` detects contact, N; chosen."""


class Functions:
    """Bound to one controller."""

    def __init__(self, controller: Controller) -> None:
        self._c = controller
        self._damping = 0.005
        self._free_drive = False

    # -- along paths --------------------------------------------------------------------------------------

    def movej(self, q: Any, a: float = 1.4, v: float = 1.05, t: float = 0.0, r: float = 0.0) -> Waiting:
        """Move to joint positions, or to a pose, linearly in the joints."""
        arm = self._c.arm
        target = target_of(arm, q, arm.q)
        if any(abs(joint) > JOINT_LIMIT_RAD for joint in target):
            raise ScriptError("movej: target is outside the joints' range")
        if t <= 0:
            a, v = positive(a, "a"), positive(v, "v")
        yield from self._path(
            lambda before: JointMove(arm, target, speed=v, acceleration=a, time_s=t, blend_m=r, before=before)
        )

    def movel(self, pose: Any, a: float = 1.2, v: float = 0.25, t: float = 0.0, r: float = 0.0) -> Waiting:
        """Move to a pose, or to joint positions, along a straight line of the tool."""
        arm = self._c.arm
        target = _pose(arm, pose)
        if t <= 0:
            a, v = positive(a, "a"), positive(v, "v")
        yield from self._path(
            lambda before: LineMove(arm, target, speed=v, acceleration=a, time_s=t, blend_m=r, before=before)
        )

    def movep(self, pose: Any, a: float = 1.2, v: float = 0.25, r: float = 0.0) -> Waiting:
        """Move along a straight line for a process; the mock treats it like movel with a blend."""
        yield from self.movel(pose, a, v, 0.0, r)

    def movec(
        self, pose_via: Any, pose_to: Any, a: float = 1.2, v: float = 0.25, r: float = 0.0, mode: int = 0
    ) -> Waiting:
        """Move along a circular arc through a point to a target; mode 1 keeps the orientation."""
        arm = self._c.arm
        via, to = _pose(arm, pose_via), _pose(arm, pose_to)
        a, v = positive(a, "a"), positive(v, "v")
        yield from self._path(
            lambda before: ArcMove(
                arm, via, to, speed=v, acceleration=a, blend_m=r, before=before, keep_orientation=int(mode) == 1
            )
        )

    def optimovej(self, q: Any, a: float = 0.3, v: float = 0.3, r: float = 0.0) -> Waiting:
        """Move linearly in the joints, at fractions of their limits."""
        limit = min(self._c.kinematics.model.joint_speed_rad_s)
        yield from self.movej(q, a * 12.0, v * limit, 0.0, r)

    def optimovel(self, pose: Any, a: float = 0.3, v: float = 0.3, r: float = 0.0) -> Waiting:
        """Move along a straight line, at fractions of the tool's limits."""
        yield from self.movel(pose, a * 5.0, v * 2.0, 0.0, r)

    # -- followed each cycle ------------------------------------------------------------------------------

    def speedj(self, qd: Any, a: float = 1.4, t: float = 0.0, t_min: float = 0.0) -> Waiting:
        """Accelerate the joints to a velocity; return after a time, or at that velocity.

        Without acceleration they keep their speed.
        """
        yield from self._until_done(SpeedMode(self._c.arm, numbers(qd), not_negative(a, "a"), t or t_min))

    def speedl(self, xd: Any, a: float = 1.2, t: float = 0.0, aRot: float = 0.0) -> Waiting:
        """Accelerate the tool to a velocity; return after a time, or at that velocity.

        Without acceleration it keeps its speed.
        """
        yield from self._until_done(ToolSpeedMode(self._c.arm, numbers(xd), not_negative(a, "a"), t))

    def servoj(
        self, q: Any, a: float = 0.0, v: float = 0.0, t: float = 0.002, lookahead_time: float = 0.1, gain: float = 300
    ) -> Waiting:
        """Follow joint positions that the script updates continuously."""
        yield from self._until_done(ServoMode(self._c.arm, numbers(q), t, lookahead_time, gain))

    def servoc(self, pose: Any, a: float = 1.2, v: float = 0.25, r: float = 0.0) -> Waiting:
        """Follow poses, with blends between them."""
        yield from self.movel(pose, a, v, 0.0, r)

    def direct_torque(self, torque: Any, **_friction: Any) -> Waiting:
        """Hold the position for a cycle under any torque, because dynamics are not modelled."""
        numbers(torque)
        yield

    def stopj(self, a: float = 2.0) -> Waiting:
        """Bring the joints to rest."""
        yield from self._until_done(StopJoints(self._c.arm, a))

    def stopl(self, a: float = 1.2, aRot: float = 0.0) -> Waiting:
        """Bring the tool to rest on its line."""
        yield from self._until_done(StopTool(self._c.arm, a))

    # -- force, freedrive, contact ------------------------------------------------------------------------

    def force_mode(self, task_frame: Any, selection_vector: Any, wrench: Any, type: int, limits: Any) -> None:
        """Enable force mode: the tool yields along selected axes of a frame until it exerts the requested wrench."""
        frame = numbers(task_frame)
        if int(type) == 3:
            frame = list(self._c.tcp_pose)
        self._c.motion.compliance = Compliance(
            rotation_of(frame[3:]), list(map(int, numbers(selection_vector))), numbers(wrench), numbers(limits)
        )

    def end_force_mode(self) -> None:
        """Leave force mode."""
        self._c.motion.compliance = None

    def force_mode_set_damping(self, damping: float) -> None:
        """Set the damping of force mode; at 1 the tool does not move."""
        self._damping = min(max(damping, 0.0), 1.0)

    def force_mode_set_gain_scaling(self, scaling: float) -> None:
        """Set the gain of force mode, 0..2."""
        self._c.motion.compliance_gain = min(max(scaling, 0.0), 2.0)

    def freedrive_mode(self, freeAxes: Any = None, feature: Any = None) -> None:
        """Enable freedrive (hand guiding), in which the mock's arm does not move."""
        self._free_drive = True

    def end_freedrive_mode(self) -> None:
        """Leave freedrive."""
        self._free_drive = False

    def get_freedrive_status(self) -> int:
        """Return 0 for off, 1 for on."""
        return int(self._free_drive)

    def teach_mode(self) -> None:
        """Enable freedrive by its older name."""
        self._free_drive = True

    def end_teach_mode(self) -> None:
        """Leave teach mode."""
        self._free_drive = False

    def tool_contact(self, direction: Any = None) -> int:
        """Return the cycles since the tool made contact in a direction (zeros: any); 0 for no contact."""
        force = self._c.tcp_force[:3]
        along = list(direction)[:3] if direction is not None else [0.0, 0.0, 0.0]
        size = sum(d * d for d in along) ** 0.5
        if size < 1e-9:
            push = sum(f * f for f in force) ** 0.5
        else:
            push = -sum(f * d for f, d in zip(force, along, strict=True)) / size
        return 4 if push > _TOOL_CONTACT_N else 0

    # -- inside -------------------------------------------------------------------------------------------

    def _path(self, make: Any) -> Waiting:
        motion = self._c.motion
        try:
            move: PathMove = make(motion.before)
        except Unreachable as error:
            pose = ", ".join(f"{value:.3f}" for value in error.pose)
            self._c.protective_stop(PATH_CHECK, f"p[{pose}] is out of reach", 3)
            yield
            return
        yield from self._until_done(move)

    def _until_done(self, move: Move) -> Waiting:
        motion = self._c.motion
        motion.start(move)
        try:
            # Take at least one cycle, even if the arm is already at the target.
            yield
            while not move.done:
                yield
        finally:
            motion.drop(move)


def _pose(arm: ArmMotion, target: Any) -> list[float]:
    wanted = numbers(target)
    return wanted if isinstance(target, Pose) else arm.tcp(wanted)
