"""The primary and secondary interfaces: they send robot state at 10 Hz and messages, and receive scripts.

Layouts: Universal Robots, "client interfaces", version 5.10 and later.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from lsds_mocks.wire.ur.kinematics import JOINT_LIMIT_RAD, JOINTS, ArmModel
from lsds_mocks.wire.ur.messages import (
    ErrorCode,
    KeyMessage,
    Message,
    PopupMessage,
    RuntimeExceptionMessage,
    SafetyModeMessage,
    TextMessage,
)
from lsds_mocks.wire.ur.modes import RobotMode, SafetyMode
from lsds_mocks.wire.ur.net import Link
from lsds_mocks.wire.ur.upload import Scripts, ScriptSession
from lsds_mocks.wire.ur.variables import joint_mode

if TYPE_CHECKING:
    from lsds_mocks.wire.ur.controller import Controller

CYCLES_PER_STATE = 50
"""Cycles between two state packages: 10 Hz."""

STATE = 16
"""Message type: robot state."""
MESSAGE = 20
"""Message type: robot message."""
ROBOT_SOURCE = 0xFE
"""Source of a message: the robot."""
SAFETY_SOURCE = 0xFD
"""Source of a message: the safety system."""
PROGRAM_SOURCE = 0xFF
"""Source of a message: the program."""
POPUP_TEXT = 0
"""Type of answer that a popup asks for: none, it only shows a text."""
CONTROL_RUNNING = 0
"""Control mode of position control."""
CONTROL_FORCE = 2
"""Control mode of force control."""


class StateFace:
    """All clients of the primary or of the secondary interface.

    `scripts` receives their uploads; None for a read-only port. `all_messages` is True for the primary interface.
    """

    def __init__(self, controller: Controller, scripts: Scripts | None, *, all_messages: bool) -> None:
        self._controller = controller
        self._scripts = scripts
        self._all_messages = all_messages
        self._links: dict[Link, int] = {}
        self._modes = self._present_modes()

    def open(self, link: Link) -> ScriptSession:
        """Greet a new client with the version; the state follows half a period later, for clients start without it."""
        link.send(version_message(self._controller))
        self._links[link] = self._controller.step_number + CYCLES_PER_STATE // 2
        return ScriptSession(self, link, self._controller, self._scripts)

    def forget(self, link: Link) -> None:
        """Remove a client."""
        self._links.pop(link, None)

    def publish(self, messages: list[Message]) -> None:
        """Send messages, and the state if it is due or a mode has changed.

        The state precedes the message that reports a change of mode, so that no client acts on an old mode.
        """
        modes, before = self._present_modes(), self._modes
        self._modes = modes
        if not self._links:
            return
        step = self._controller.step_number
        if step % CYCLES_PER_STATE == 0 or modes != before:
            state = robot_state(self._controller)
            for link, first in self._links.items():
                if step >= first:
                    link.send(state, may_drop=True)
        if self._all_messages:
            for message in messages:
                data = encoded(message, self._controller)
                for link in self._links:
                    link.send(data, may_drop=True)

    def _present_modes(self) -> tuple[RobotMode, SafetyMode]:
        return self._controller.power.mode, self._controller.safety


# -- packages -------------------------------------------------------------------------------------------------


def _package(kind: int, body: bytes) -> bytes:
    return struct.pack(">ib", len(body) + 5, kind) + body


def _message(controller: Controller, source: int, kind: int, body: bytes) -> bytes:
    return _package(MESSAGE, struct.pack(">QBb", _microseconds(controller), source, kind) + body)


def _microseconds(controller: Controller) -> int:
    return round(controller.time_s * 1e6)


def version_message(controller: Controller) -> bytes:
    """Return the message that opens every connection."""
    major, minor, bugfix, build = map(int, controller.options.version.split("."))
    name, date = b"URControl", b"29-04-2024, 12:00:00"
    body = bytes([len(name)]) + name + struct.pack(">BBii", major, minor, bugfix, build) + date
    return _message(controller, ROBOT_SOURCE, 3, body)


def encoded(message: Message, controller: Controller) -> bytes:
    """Return a message's bytes."""
    if isinstance(message, TextMessage):
        return _message(controller, PROGRAM_SOURCE, 0, message.text.encode())
    if isinstance(message, PopupMessage):
        title = message.title.encode()[:255]
        flags = struct.pack(">IB3?B", 0, POPUP_TEXT, message.warning, message.error, message.blocking, len(title))
        return _message(controller, PROGRAM_SOURCE, 2, flags + title + message.text.encode())
    if isinstance(message, KeyMessage):
        title = message.title.encode()
        body = struct.pack(">iiB", 0, 0, len(title)) + title + message.text.encode()
        return _message(controller, PROGRAM_SOURCE, 7, body)
    if isinstance(message, ErrorCode):
        body = struct.pack(">iiiII", message.code, message.argument, message.level, 0, 0) + message.text.encode()
        return _message(controller, SAFETY_SOURCE, 6, body)
    if isinstance(message, RuntimeExceptionMessage):
        body = struct.pack(">ii", message.line, message.column) + message.text.encode()
        return _message(controller, PROGRAM_SOURCE, 10, body)
    assert isinstance(message, SafetyModeMessage)
    body = struct.pack(">iiBII", message.code, message.argument, message.mode, 0, 0)
    return _message(controller, SAFETY_SOURCE, 5, body)


def robot_state(controller: Controller) -> bytes:
    """Return the robot-state package with all its parts."""
    parts = (
        (0, _mode_data(controller)),
        (1, _joint_data(controller)),
        (2, _tool_data(controller)),
        (3, _masterboard(controller)),
        (4, struct.pack(">12d", *controller.tcp_pose, *controller.arm.tcp_offset)),
        (5, _kinematics(controller.kinematics.model)),
        (6, _configuration(controller.kinematics.model)),
        (7, struct.pack(">7d", *controller.tcp_force, 0.0)),
    )
    return _package(STATE, b"".join(struct.pack(">IB", len(body) + 5, kind) + body for kind, body in parts))


def _mode_data(c: Controller) -> bytes:
    powered = c.power.mode in (RobotMode.POWER_ON, RobotMode.IDLE, RobotMode.RUNNING)
    stopped = c.safety is SafetyMode.PROTECTIVE_STOP
    running = c.program is not None and not c.program.paused
    paused = c.program is not None and c.program.paused
    flags = (True, True, powered, c.safety in (SafetyMode.SYSTEM_EMERGENCY_STOP, SafetyMode.ROBOT_EMERGENCY_STOP))
    control = CONTROL_FORCE if c.motion.compliance is not None else CONTROL_RUNNING
    return struct.pack(
        ">Q7?BBdddB",
        _microseconds(c),
        *flags,
        stopped,
        running,
        paused,
        int(c.power.mode),
        control,
        c.scaling,
        c.scaling,
        1.0,
        0,
    )


def _joint_data(c: Controller) -> bytes:
    mode = joint_mode(c)
    return b"".join(
        struct.pack(">dddffffB", q, q, c.scaling * qd, 0.0, 48.0, 28.0, 28.0, mode)
        for q, qd in zip(c.arm.q, c.arm.qd, strict=True)
    )


def _tool_data(c: Controller) -> bytes:
    return struct.pack(">bbddfBffB", 0, 0, 0.0, 0.0, 48.0, c.io.tool_voltage, 0.0, 28.0, joint_mode(c))


def _masterboard(c: Controller) -> bytes:
    io = c.io
    domains = [int(voltage) for voltage in io.analog_is_voltage]
    return struct.pack(
        ">IIBBddbbddffffBBBIBBB",
        io.digital_in,
        io.digital,
        1,
        1,
        *io.analog_in,
        *domains,
        io.shown(0),
        io.shown(1),
        28.0,
        48.0,
        0.6,
        0.0,
        int(c.safety),
        0,
        0,
        0,
        0,
        0,
        0,
    )


def denavit_hartenberg(model: ArmModel) -> tuple[list[float], list[float], list[float], list[float]]:
    """Return theta, a, d, alpha of the six joints."""
    right = 1.5707963267948966
    return (
        [0.0] * JOINTS,
        [0.0, model.a2, model.a3, 0.0, 0.0, 0.0],
        [model.d1, 0.0, 0.0, model.d4, model.d5, model.d6],
        [right, 0.0, 0.0, right, -right, 0.0],
    )


def _kinematics(model: ArmModel) -> bytes:
    theta, a, d, alpha = denavit_hartenberg(model)
    checksums = [round(abs(x) * 1e6) + 1 for x in d]
    return struct.pack(">6I24dI", *checksums, *theta, *a, *d, *alpha, 1)


def _configuration(model: ArmModel) -> bytes:
    theta, a, d, alpha = denavit_hartenberg(model)
    limits = [value for _ in range(JOINTS) for value in (-JOINT_LIMIT_RAD, JOINT_LIMIT_RAD)]
    fastest = [value for speed in model.joint_speed_rad_s for value in (speed, 40.0)]
    defaults = (1.05, 1.4, 0.25, 1.2, 0.25)
    numbers = (*limits, *fastest, *defaults, *a, *d, *alpha, *theta)
    return struct.pack(f">{len(numbers)}d", *numbers) + struct.pack(">iiiiHH", 0, 0, model.type_number, 0, 0, 0)
