"""The controller: in each cycle of two milliseconds it applies inputs, runs programs and moves the arm.

It has no sockets and reads no clock. Its owner calls `cycle` 500 times a second, feeds in what clients send, and reads
its state and `messages`.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from lsds_mocks.wire.ur.environment import Environment
from lsds_mocks.wire.ur.io import Outputs, Registers
from lsds_mocks.wire.ur.kinematics import MODELS, Kinematics
from lsds_mocks.wire.ur.messages import (
    VIOLATION,
    WARNING,
    ErrorCode,
    KeyMessage,
    Message,
    PopupMessage,
    RuntimeExceptionMessage,
    SafetyModeMessage,
    TextMessage,
)
from lsds_mocks.wire.ur.modes import RobotMode, RuntimeState, SafetyMode
from lsds_mocks.wire.ur.motion.modes import tool_velocity
from lsds_mocks.wire.ur.motion.motion import JointLimit, Motion
from lsds_mocks.wire.ur.motion.state import ArmMotion, Unreachable
from lsds_mocks.wire.ur.power import Power
from lsds_mocks.wire.ur.script.compiler import Compiled
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.script.operations import Operations
from lsds_mocks.wire.ur.script.program import Program
from lsds_mocks.wire.ur.script.work import CYCLE, Work

if TYPE_CHECKING:
    from lsds_mocks.wire.ur.options import UrOptions

CYCLE_S = 0.002
"""Control cycle of an e-Series arm (s): 500 Hz."""
BOOTED_S = 100.0
"""Controller time at the start (s); at a time near 0, clients wait for the controller to boot."""

UNLOCK_AFTER_S = 5.0
"""Time after which a protective stop can be unlocked (s); the message below states it."""
UNLOCK_EARLY = (
    "Cannot unlock protective stop until 5s after occurrence. Always inspect cause of protective stop before unlocking"
)
MOST_SECONDARIES = 16
"""Maximum number of secondary programs at once; chosen."""
PROTECTIVE_STOP = 209
"""Error code of a protective stop."""
PATH_CHECK = 204
"""Error code of a position that is out of reach."""
JOINT_RANGE = 153
"""Error code of a joint beyond its range."""
HISTORY = 1500
"""Number of joint positions kept for `get_actual_joint_positions_history`, one per cycle."""


class Library(Protocol):
    """The functions that one program can call, by name; `lsds_mocks.wire.ur.functions` has the real ones."""

    @property
    def functions(self) -> Mapping[str, Callable[..., Any]]:
        """The interface of a controller for scripts."""
        ...

    def close(self) -> None:
        """Close everything that the program has opened."""
        ...


class Controller:
    """State and behaviour of one arm.

    `library` makes the functions of each program from the ports to which that program may open a socket.
    """

    def __init__(
        self, options: UrOptions, environment: Environment, library: Callable[[Controller, frozenset[int]], Library]
    ) -> None:
        self._library = library
        self.options = options
        self.kinematics = Kinematics(MODELS[options.model])
        self.arm = ArmMotion(self.kinematics, list(options.q_rad), tcp_offset=list(options.tcp_offset))
        self.motion = Motion(self.arm)
        self.environment = environment
        self.inputs, self.registers, self.io = Registers(), Registers(), Outputs()
        self.power = Power(RobotMode.RUNNING if options.powered else RobotMode.POWER_OFF)
        self.safety = SafetyMode.NORMAL
        self.program: Program | None = None
        self.secondaries: list[Program] = []
        self.messages: deque[Message] = deque(maxlen=4096)
        self.payload_kg = options.payload_kg
        self.payload_cog_m = list(options.payload_cog_m)
        self.payload_inertia = [0.0] * 6
        self.gravity = [0.0, 0.0, 9.82]
        self.wrench = [0.0] * 6
        self.force_offset = [0.0] * 6
        self.history: deque[list[float]] = deque([list(self.arm.q)], maxlen=HISTORY)
        self.watchdogs: dict[str, tuple[float, str]] = {}
        self.written_s: dict[str, float] = {}
        self.step_number = 0
        self.work = Work()
        self.operations = Operations(self.work)
        self.inverses = self.reads = 0
        self.remote = options.remote_control
        self.handovers = 0
        self.popup: PopupMessage | None = None
        self._pending: deque[Mapping[str, Any]] = deque()
        self._stopped_at_s = 0.0
        self._tcp: tuple[list[float], list[float], list[float]] = ([], [], [])
        self._tcp_speed: tuple[int, list[float]] = (-1, [])

    # -- state --------------------------------------------------------------------------------------------

    @property
    def time_s(self) -> float:
        """Time since the controller's start (s), in steps of exactly two milliseconds."""
        return BOOTED_S + self.step_number * CYCLE_S

    @property
    def scaling(self) -> float:
        """The speed slider's fraction."""
        return self.io.slider

    @property
    def runtime_state(self) -> RuntimeState:
        """Of the program."""
        if self.program is None:
            return RuntimeState.STOPPED
        return RuntimeState.PAUSED if self.program.paused else RuntimeState.PLAYING

    @property
    def busy(self) -> bool:
        """Whether any program runs."""
        return self.program is not None or bool(self.secondaries)

    @property
    def may_move(self) -> bool:
        """Whether power, brakes and safety allow motion."""
        return self.power.mode is RobotMode.RUNNING and self.safety in (SafetyMode.NORMAL, SafetyMode.REDUCED)

    @property
    def tcp_pose(self) -> list[float]:
        """Pose of the tool centre point in the base frame."""
        q, offset, pose = self._tcp
        # Joints and offset are replaced, never modified, so the pose is valid while they are the same lists.
        if q is not self.arm.q or offset is not self.arm.tcp_offset:
            pose = self.arm.tcp()
            self._tcp = (self.arm.q, self.arm.tcp_offset, pose)
        return pose

    @property
    def tcp_speed(self) -> list[float]:
        """Actual velocity of the tool centre point in the base frame, scaled by the speed slider."""
        if self._tcp_speed[0] != self.step_number:
            speed = [0.0] * 6
            if self.arm.moving:
                speed = (tool_velocity(self.arm) * self.scaling).tolist()
            self._tcp_speed = (self.step_number, speed)
        return self._tcp_speed[1]

    @property
    def tcp_force(self) -> list[float]:
        """Force and torque on the tool in the base frame, less the sensor's zero."""
        return [a - b for a, b in zip(self.wrench, self.force_offset, strict=True)]

    # -- inputs -------------------------------------------------------------------------------------------

    def feed(self, values: Mapping[str, Any]) -> None:
        """Queue one input package, which takes effect at the start of the next cycle, in order of arrival."""
        self._pending.append(values)

    def start(self, compiled: Compiled) -> None:
        """Run a program: a primary one replaces the present program, a secondary one runs in parallel."""
        if self.power.mode is not RobotMode.RUNNING or self.power.goes_off:
            self.refuse(ScriptError(f"{compiled.name} is not started: the robot is in {self.power.mode.name}", 1, 1))
            return
        if self.safety is not SafetyMode.NORMAL:
            self.refuse(ScriptError(f"{compiled.name} is not started: safety is in {self.safety.name}", 1, 1))
            return
        library = self._library(self, compiled.ports)
        program = Program(compiled, library.functions, self.work, library.close)
        if compiled.secondary:
            if len(self.secondaries) >= MOST_SECONDARIES:
                self.refuse(ScriptError(f"more than {MOST_SECONDARIES} secondary programs at once", 1, 1))
                return
            self.secondaries.append(program)
            return
        self.stop_program()
        self.program = program
        self.watchdogs.clear()
        self.post_message(KeyMessage("PROGRAM_XXX_STARTED", compiled.name))

    def refuse(self, error: ScriptError) -> None:
        """Report that a program cannot run."""
        self.post_message(RuntimeExceptionMessage(error.line, error.column, error.text))

    def stop_program(self) -> None:
        """End the running program, if any; the arm brakes."""
        program, self.program = self.program, None
        if program is not None:
            program.stop()
            self.popup = None
            self.motion.drop_all()
            self.post_message(KeyMessage("PROGRAM_XXX_STOPPED", program.name))

    def hand_over(self, *, remote: bool) -> None:
        """Go to remote or local control, and count the changes: those who were connected before have to reconnect."""
        self.handovers += remote != self.remote
        self.remote = remote

    def obeys(self, handovers: int) -> bool:
        """Return whether a client may command that has been connected since this number of changes."""
        return self.remote and self.handovers == handovers

    def show_popup(self, popup: PopupMessage) -> None:
        """Show a program's popup; a blocking one pauses the program."""
        # A blocking popup stays, whatever other programs show.
        if self.popup is None or not self.popup.blocking or popup.blocking:
            self.popup = popup
        self.post_message(popup)
        if popup.blocking:
            self.pause_program()

    def close_popup(self) -> None:
        """Close the popup; the program that it blocks goes on."""
        popup, self.popup = self.popup, None
        if popup is not None and popup.blocking:
            self.resume_program()

    def pause_program(self) -> bool:
        """Pause the program and the arm; return whether there is a program."""
        if self.program is None:
            return False
        self.program.pause()
        return True

    def resume_program(self) -> bool:
        """Resume a paused program; return whether there was one."""
        if self.program is None or not self.program.paused:
            return False
        self.popup = None
        self.program.resume()
        return True

    def protective_stop(self, code: int = PROTECTIVE_STOP, text: str = "", level: int = WARNING) -> None:
        """Stop the arm at once and end the program; only `unlock` ends a protective stop."""
        stopped = self.safety in (SafetyMode.PROTECTIVE_STOP, SafetyMode.ROBOT_EMERGENCY_STOP)
        if stopped or self.power.mode is not RobotMode.RUNNING:
            return
        self.safety = SafetyMode.PROTECTIVE_STOP
        self._stopped_at_s = self.time_s
        self.post_message(ErrorCode(code, 0, level, text))
        self.post_message(SafetyModeMessage(int(self.safety), code))
        self.motion.freeze()
        self.stop_program()
        self._end_secondaries()

    def press_emergency_stop(self, *, pressed: bool) -> None:
        """Press or release the emergency stop: it cuts the power, and released it leaves the arm without."""
        stopped = self.safety is SafetyMode.ROBOT_EMERGENCY_STOP
        if pressed == stopped:
            return
        self.safety = SafetyMode.ROBOT_EMERGENCY_STOP if pressed else SafetyMode.NORMAL
        self.post_message(SafetyModeMessage(int(self.safety)))
        if pressed:
            self.power_off()

    @property
    def unlockable(self) -> bool:
        """Whether a protective stop is old enough to be unlocked."""
        return self.time_s - self._stopped_at_s >= UNLOCK_AFTER_S

    def unlock(self) -> bool:
        """End a protective stop; return whether the arm is unlocked.

        Within five seconds of the stop the request is refused; the client has to repeat it.
        """
        if self.safety is not SafetyMode.PROTECTIVE_STOP:
            return True
        if not self.unlockable:
            self.post_message(TextMessage(UNLOCK_EARLY))
            return False
        self.safety = SafetyMode.NORMAL
        self.post_message(SafetyModeMessage(int(self.safety)))
        return True

    def fail_programs(self, error: ScriptError) -> None:
        """End all programs with an error."""
        for program in filter(None, (self.program, *self.secondaries)):
            program.fail(error)
            self.refuse(error)
        self.stop_program()
        self.secondaries.clear()

    def power_on(self, *, brakes: bool = False) -> None:
        """Switch the power on, with `brakes` also release the brakes; a pressed emergency stop prevents it."""
        if self.safety is not SafetyMode.ROBOT_EMERGENCY_STOP:
            (self.power.release if brakes else self.power.on)(self.time_s)

    def power_off(self) -> None:
        """Switch off the arm's power; the program ends."""
        self.motion.freeze()
        self.stop_program()
        self._end_secondaries()
        self.power.off(self.time_s)

    def restart_safety(self) -> None:
        """Clear faults; the arm is without power afterwards."""
        self.safety = SafetyMode.NORMAL
        self.power_off()

    def post_message(self, message: Message) -> None:
        """Queue a message for the primary interface."""
        self.messages.append(message)

    # -- one cycle ----------------------------------------------------------------------------------------

    def cycle(self) -> None:
        """Advance by two milliseconds."""
        self.step_number += 1
        while self._pending:
            self._apply(self._pending.popleft())
        self.power.advance(self.time_s)
        self._watch()
        self._run_programs()
        if self.may_move:
            self._move()
        elif self.arm.moving:
            self.motion.freeze()
        self.environment.follow(self.time_s, self.tcp_pose, self.tcp_speed)
        self.wrench = self.environment.wrench(self.tcp_pose, self.tcp_speed)
        self.history.append(self.arm.q)

    def _apply(self, values: Mapping[str, Any]) -> None:
        self.io.apply(values)
        now = self.time_s
        for name, value in values.items():
            self.written_s[name] = now
            kind, _, index = name.rpartition("_")
            if kind == "input_int_register":
                self.inputs.ints[int(index)] = value
            elif kind == "input_double_register":
                self.inputs.doubles[int(index)] = value
            elif kind == "input_bit_register":
                self.inputs.set_bit(int(index), bool(value))
            elif name == "input_bit_registers0_to_31":
                self.inputs.bits = self.inputs.bits >> 32 << 32 | value
            elif name == "input_bit_registers32_to_63":
                self.inputs.bits = self.inputs.bits & ~(0xFFFFFFFF << 32) | value << 32
            elif name == "external_force_torque" and all(map(math.isfinite, value)):
                self.environment.external = list(value)

    def _watch(self) -> None:
        for name, (period_s, action) in list(self.watchdogs.items()):
            if self.time_s - self.written_s.get(name, self.time_s) > period_s:
                del self.watchdogs[name]
                self.post_message(TextMessage(f"RTDE watchdog: no {name} for {period_s:g} s"))
                if action == "pause":
                    self.pause_program()
                elif action == "stop":
                    self.stop_program()

    def _run_programs(self) -> None:
        self.work.begin()
        self.inverses = self.reads = 0
        program = self.program
        if program is not None:
            program.step()
            self._report(program)
            if not program.running and self.program is program:
                self.stop_program()
        for secondary in self.secondaries[:]:
            secondary.step()
            self._report(secondary)
            if not secondary.running and secondary in self.secondaries:
                self.secondaries.remove(secondary)

    def _report(self, program: Program) -> None:
        if program.error is not None:
            self.refuse(program.error)
            # A program that exhausts the shared budget must leave the others enough to continue.
            self.work.left = max(self.work.left, CYCLE)

    def _move(self) -> None:
        scaling = 0.0 if self.program is not None and self.program.paused else self.scaling
        try:
            self.motion.step(CYCLE_S * scaling, self.tcp_force)
        except Unreachable as error:
            self.protective_stop(PATH_CHECK, f"position {_shown(error.pose)} is out of reach", VIOLATION)
        except JointLimit as error:
            self.protective_stop(JOINT_RANGE, str(error), VIOLATION)

    def _end_secondaries(self) -> None:
        for secondary in self.secondaries:
            secondary.stop()
        self.secondaries.clear()


def _shown(pose: Sequence[float]) -> str:
    return "p[" + ", ".join(f"{value:.3f}" for value in pose) + "]"
