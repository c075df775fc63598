"""Script functions that return the arm's state, and set its payload and mounting."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds_mocks.wire.ur.kinematics import JOINT_LIMIT_RAD, JOINTS
from lsds_mocks.wire.ur.motion.state import Unreachable
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.script.program import Waiting
from lsds_mocks.wire.ur.script.values import Pose, UrList
from lsds_mocks.wire.ur.targets import numbers

if TYPE_CHECKING:
    from lsds_mocks.wire.ur.controller import Controller


INVERSES = 6
"""Maximum number of inverse kinematics per cycle; further ones wait for the next cycle."""


class Functions:
    """Bound to one controller."""

    def __init__(self, controller: Controller) -> None:
        self._c = controller

    # -- position and speed -------------------------------------------------------------------------------

    def get_actual_joint_positions(self) -> UrList:
        """Return joint positions (rad)."""
        return UrList(self._c.arm.q)

    def get_joint_positions(self) -> UrList:
        """Return joint positions (rad)."""
        return UrList(self._c.arm.q)

    def get_target_joint_positions(self) -> UrList:
        """Return joint positions (rad)."""
        return UrList(self._c.arm.q)

    def get_actual_joint_positions_history(self, steps: int = 0) -> UrList:
        """Return the joint positions of `steps` cycles ago."""
        history = self._c.history
        return UrList(history[-1 - min(max(int(steps), 0), len(history) - 1)])

    def get_actual_joint_speeds(self) -> UrList:
        """Return joint speeds (rad/s)."""
        return UrList([self._c.scaling * speed for speed in self._c.arm.qd])

    def get_target_joint_speeds(self) -> UrList:
        """Return joint speeds (rad/s)."""
        return self.get_actual_joint_speeds()

    def get_target_joint_accelerations(self) -> UrList:
        """Return joint accelerations (rad/s2)."""
        return UrList(self._c.arm.qdd)

    def get_actual_tcp_pose(self) -> Pose:
        """Return the TCP's pose."""
        return Pose(self._c.tcp_pose)

    def get_target_tcp_pose(self) -> Pose:
        """Return the TCP's pose."""
        return Pose(self._c.tcp_pose)

    def get_actual_tcp_speed(self) -> UrList:
        """Return the TCP's velocity."""
        return UrList(self._c.tcp_speed)

    def get_target_tcp_speed(self) -> UrList:
        """Return the TCP's velocity."""
        return UrList(self._c.tcp_speed)

    def get_actual_tool_flange_pose(self) -> Pose:
        """Return the flange's pose."""
        return Pose(self._c.kinematics.flange(self._c.arm.q))

    def get_target_waypoint(self) -> Pose:
        """Return the TCP's pose; waypoints ahead are not supported."""
        return Pose(self._c.tcp_pose)

    def is_steady(self) -> bool:
        """Return whether the arm has come to rest."""
        return self._c.motion.steady

    def get_steptime(self) -> float:
        """Return the cycle's length (s)."""
        return 0.002

    # -- kinematics ---------------------------------------------------------------------------------------

    def get_forward_kin(self, q: Any = None, tcp: Any = None) -> Pose:
        """Return the pose for joint positions."""
        joints = self._c.arm.q if q is None else numbers(q)
        return Pose(self._c.kinematics.tcp(joints, self._c.arm.tcp_offset if tcp is None else numbers(tcp)))

    def get_inverse_kin(
        self,
        x: Any,
        qnear: Any = None,
        maxPositionError: float = 1e-10,
        maxOrientationError: float = 1e-10,
        tcp: Any = None,
    ) -> Waiting:
        """Return joint positions for a pose, nearest to `qnear`. Raises ScriptError if there is no solution."""
        yield from self._turn()
        q = self._inverse(x, qnear, tcp)
        if q is None:
            raise ScriptError("get_inverse_kin: unable to find an inverse kinematics solution")
        return UrList(q)

    def get_inverse_kin_has_solution(
        self,
        x: Any,
        qnear: Any = None,
        maxPositionError: float = 1e-10,
        maxOrientationError: float = 1e-10,
        tcp: Any = None,
    ) -> Waiting:
        """Return whether a pose can be reached."""
        yield from self._turn()
        return self._inverse(x, qnear, tcp) is not None

    def get_jacobian(self, q: Any = None, tcp: Any = None) -> UrList:
        """Return the Jacobian as six rows."""
        joints = self._c.arm.q if q is None else numbers(q)
        return _rows(self._jacobian(joints, self._c.arm.tcp_offset if tcp is None else numbers(tcp)))

    def get_jacobian_time_derivative(self, q: Any = None, qd: Any = None, tcp: Any = None) -> UrList:
        """Return the Jacobian's rate of change as six rows, by central differences."""
        joints = self._c.arm.q if q is None else numbers(q)
        speeds = self._c.arm.qd if qd is None else numbers(qd)
        offset = self._c.arm.tcp_offset if tcp is None else numbers(tcp)
        h = 1e-5
        ahead = self._jacobian([a + h * b for a, b in zip(joints, speeds, strict=True)], offset)
        behind = self._jacobian([a - h * b for a, b in zip(joints, speeds, strict=True)], offset)
        return _rows((ahead - behind) / (2 * h))

    def get_mass_matrix(self, q: Any = None, include_rotors_inertia: bool = True) -> UrList:
        """Return the unit matrix: the arm's masses are not modelled."""
        return _rows(np.eye(JOINTS))

    def get_coriolis_and_centrifugal_torques(self, q: Any = None, qd: Any = None) -> UrList:
        """Return zeros: the arm's masses are not modelled."""
        return UrList([0.0] * JOINTS)

    def is_within_safety_limits(self, target: Any) -> Waiting:
        """Return whether a pose is in reach, or joint positions are in range."""
        yield from self._turn()
        if isinstance(target, Pose):
            return self._inverse(target, None, None) is not None
        return all(abs(joint) <= JOINT_LIMIT_RAD for joint in numbers(target))

    # -- force --------------------------------------------------------------------------------------------

    def get_tcp_force(self) -> UrList:
        """Return force and torque on the tool."""
        return UrList(self._c.tcp_force)

    def force(self) -> float:
        """Return the size of the force on the tool (N)."""
        force: float = float(np.linalg.norm(self._c.tcp_force[:3]))
        return force

    def zero_ftsensor(self) -> None:
        """Set the sensor's zero to the present reading."""
        self._c.force_offset = list(self._c.wrench)

    def get_joint_torques(self) -> UrList:
        """Return the joint torques that the force on the tool causes; gravity is compensated."""
        jacobian = self._jacobian(self._c.arm.q, self._c.arm.tcp_offset)
        return UrList((jacobian.T @ np.array(self._c.tcp_force)).tolist())

    def enable_external_ft_sensor(
        self, enable: bool, sensor_mass: float = 0.0, sensor_measuring_offset: Any = None, sensor_cog: Any = None
    ) -> None:
        """Add the force of the input `external_force_torque` to the environment's."""
        if not enable:
            self._c.environment.external = [0.0] * JOINTS

    def ft_rtde_input_enable(
        self, enable: bool, sensor_mass: float = 0.0, sensor_measuring_offset: Any = None, sensor_cog: Any = None
    ) -> None:
        """Add the force of the input `external_force_torque` to the environment's."""
        self.enable_external_ft_sensor(enable, sensor_mass, sensor_measuring_offset, sensor_cog)

    # -- tool, payload, mounting --------------------------------------------------------------------------

    def set_tcp(self, pose: Any, tcp_name: str = "") -> None:
        """Set the tool centre point on the flange."""
        self._c.arm.tcp_offset = numbers(pose)

    def get_tcp_offset(self) -> Pose:
        """Return the tool centre point on the flange."""
        return Pose(self._c.arm.tcp_offset)

    def set_payload(self, m: float, cog: Any = None) -> None:
        """Set the payload (kg) and its centre of gravity (m)."""
        self.set_target_payload(m, cog)

    def set_payload_mass(self, m: float) -> None:
        """Set the payload (kg)."""
        self.set_target_payload(m)

    def set_payload_cog(self, cog: Any) -> None:
        """Set the payload's centre of gravity (m)."""
        self._c.payload_cog_m = numbers(cog, 3)

    def set_target_payload(self, m: float, cog: Any = None, inertia: Any = None, transition_time: float = 0.0) -> None:
        """Set payload (kg), centre of gravity (m) and inertia (kg m2)."""
        if not 0 <= m <= 2 * self._c.kinematics.model.payload_kg:
            raise ScriptError(f"set_target_payload: {m} kg is out of range")
        self._c.payload_kg = float(m)
        if cog is not None:
            self.set_payload_cog(cog)
        if inertia is not None:
            self._c.payload_inertia = numbers(inertia)

    def get_target_payload(self) -> float:
        """Return the payload (kg)."""
        return self._c.payload_kg

    def get_target_payload_cog(self) -> UrList:
        """Return its centre of gravity (m)."""
        return UrList(self._c.payload_cog_m)

    def get_target_payload_inertia(self) -> UrList:
        """Return its inertia (kg m2)."""
        return UrList(self._c.payload_inertia)

    def get_payload(self) -> float:
        """Return the payload (kg)."""
        return self._c.payload_kg

    def set_gravity(self, d: Any) -> None:
        """Set the direction of gravity's reaction in the base frame (m/s2)."""
        self._c.gravity = numbers(d, 3)

    def protective_stop(self) -> None:
        """Stop the arm as the safety system does."""
        self._c.protective_stop()

    # -- inside -------------------------------------------------------------------------------------------

    def _turn(self) -> Waiting:
        """Wait for a cycle with time for one more inverse kinematics."""
        while self._c.inverses >= INVERSES:
            yield
        self._c.inverses += 1

    def _inverse(self, x: Any, near: Any, tcp: Any) -> list[float] | None:
        arm = self._c.arm
        near = arm.q if near is None else numbers(near)
        offset = arm.tcp_offset
        if tcp is not None:
            arm.tcp_offset = numbers(tcp)
        try:
            return arm.joints(numbers(x), near)
        except Unreachable:
            return None
        finally:
            arm.tcp_offset = offset

    def _jacobian(self, q: Sequence[float], offset: Sequence[float]) -> np.ndarray[Any, np.dtype[np.float64]]:
        return self._c.kinematics.jacobian(q, self._c.kinematics.tcp(q, offset)[:3])


def _rows(matrix: np.ndarray[Any, np.dtype[np.float64]]) -> UrList:
    return UrList([UrList(row) for row in matrix.tolist()])
