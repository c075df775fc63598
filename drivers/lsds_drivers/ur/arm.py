"""The driver: an `Arm` that communicates through a child process."""

from __future__ import annotations

import contextlib
import math
import socket
import threading
import time
from typing import TYPE_CHECKING

from lsds.clock import seconds
from lsds.contracts import ArmCommand, ArmSpec, ArmState, Lifecycle, Pose, Quaternion, Twist
from lsds.contracts.lifecycle import LifecycleGuard
from lsds.errors import (
    CommandExpired,
    ConnectFailed,
    ConnectionLost,
    DeviceError,
    DeviceFault,
    DeviceTimeout,
    LimitExceeded,
    StaleData,
)
from lsds_drivers.ur.child import Child
from lsds_drivers.ur.options import REACH_M, UrOptions
from lsds_drivers.ur.packets import Command, Kind, State, pack_command

if TYPE_CHECKING:
    from lsds.contracts import BuildContext

DASHBOARD_PORT = 29999
"""TCP port of the dashboard server (Universal Robots, "Dashboard Server")."""
DASHBOARD_S = 0.4
"""Time limit for connecting to the dashboard, and for each of its answers (s); chosen."""
RECONNECT_S = (0.5, 5.0)
"""First and longest pause before a lost arm is connected again (s); chosen."""
NORMAL_BIT = 1
"""Bit of the RTDE safety status: normal mode."""
PROTECTIVE_BIT = 4
"""Bit of the RTDE safety status: protective stop."""
PLAYING = 2
"""RTDE runtime state of a program that runs."""
PROGRAM_SHOWS_NS = 100_000_000
"""Time after arming in which a state may still be an older one."""


class UrArm:
    """An `Arm`. States come from the controller with its own timestamps, mapped to the rig's clock.

    If the child process or the connection is lost, one call raises a DeviceError with the reason; a new child is
    started with increasing pauses, and reading continues when it has connected. Commands are refused until the arm is
    disarmed and armed again, because its motion in between is unknown.
    """

    def __init__(self, options: UrOptions, context: BuildContext) -> None:
        self.options = options
        self._clock = context.clock
        self._name = options.model
        self._guard = LifecycleGuard(self._name)
        self._child: Child | None = None
        self._armed_child: Child | None = None
        self._armed_ns = 0
        self._fault: DeviceError | None = None
        self._stop_result = ""
        self._closing = threading.Event()
        self._keeper: threading.Thread | None = None

    @property
    def lifecycle(self) -> Lifecycle:
        """The state of the device's life cycle."""
        return self._guard.state

    @property
    def spec(self) -> ArmSpec:
        """Speed, acceleration, reach."""
        return ArmSpec(self.options.speed_limit_m_s, self.options.acceleration_limit_m_s2, REACH_M[self.options.model])

    def connect(self) -> None:
        """Start the child and wait for its first state. Raises ConnectFailed."""
        with self._guard.connecting():
            self._child = self._started()
            self._closing.clear()
            self._keeper = threading.Thread(target=self._keep, name=f"{self._name} keeper", daemon=True)
            self._keeper.start()

    def arm(self) -> None:
        """Take control: upload the control program, set TCP and payload. Nothing moves.

        Raises DeviceFault with the controller's code if it refuses; DeviceTimeout.
        """
        with self._guard.arming():
            child = self._living()
            reply = child.request(Kind.ARM, self.options.connect_timeout_s)
            if reply.problem:
                raise DeviceFault(self._name, reply.problem, remedy=reply.remedy, code=reply.code)
            self._fault, self._stop_result = None, ""
            self._armed_child, self._armed_ns = child, time.monotonic_ns() + PROGRAM_SHOWS_NS

    def stop(self) -> None:
        """Decelerate to rest through the child or, if it has ended, through the controller's dashboard."""
        child = self._child
        if child is None or self._guard.state is Lifecycle.CLOSED:
            return
        with contextlib.suppress(Exception):
            sent = child.ended is None and child.send(bytes([Kind.STOP]))
            if not sent and self._guard.state is Lifecycle.ARMED:
                self._stop_by_dashboard()

    @property
    def stop_result(self) -> str:
        """Result of the last stop through the dashboard, which is used if the connection is lost; "" without one."""
        return self._stop_result

    def disarm(self) -> None:
        """Decelerate to rest and release control."""
        with self._guard.disarming() as armed:
            child = self._armed_child
            self._armed_child = None
            if armed and child is not None and child.ended is None:
                with contextlib.suppress(DeviceError):
                    child.request(Kind.DISARM, self.options.connect_timeout_s)

    def close(self) -> None:
        """Decelerate to rest and close the device."""
        with self._guard.closing() as first:
            if not first:
                return
            self._closing.set()
            if self._keeper is not None:
                self._keeper.join(self.options.connect_timeout_s + 1.0)
            if self._child is not None:
                self._child.close()

    def read(self) -> ArmState:
        """Return the newest state.

        Raises DeviceError once if the connection was lost, then StaleData until it is restored.
        """
        self._guard.require_readable()
        fault, self._fault = self._fault, None
        if fault is not None:
            raise fault
        state = self._child.state if self._child is not None else None
        if state is None:
            raise StaleData(self._name, "no state has arrived yet", remedy="wait for the first one and read again")
        age_s = seconds(self._clock.now() - state.t_ns)
        if age_s * 1e3 > self.options.stale_after_ms:
            remedy = "see whether the controller still runs, and the network"
            raise StaleData(self._name, f"the newest state is {age_s * 1e3:.0f} ms old", remedy=remedy)
        return _arm_state(state)

    def command(self, command: ArmCommand) -> ArmCommand:
        """Send a command, limited to the speeds and the acceleration of the options; return it as sent.

        Raises LifecycleError, LimitExceeded (not finite, acceleration not positive), CommandExpired, DeviceFault in a
        protective stop and after a lost connection.
        """
        self._guard.require_armed()
        linear, angular = command.twist.linear_m_s, command.twist.angular_rad_s
        if not all(map(math.isfinite, (*linear, *angular, command.acceleration_m_s2))):
            raise LimitExceeded(self._name, f"not a finite command: {command}", remedy="command numbers only")
        if command.acceleration_m_s2 <= 0:
            raise LimitExceeded(self._name, "acceleration must be above zero")
        now = self._clock.now()
        if now >= command.expires_ns:
            late_ms = seconds(now - command.expires_ns) * 1e3
            raise CommandExpired(
                self._name, f"command came {late_ms:.1f} ms after its expiry", remedy="send a fresh one"
            )
        child = self._commandable()
        sent = ArmCommand(
            Twist(_limited(linear, self.options.speed_limit_m_s), _limited(angular, self.options.turn_limit_rad_s)),
            min(command.acceleration_m_s2, self.options.acceleration_limit_m_s2),
            command.expires_ns,
        )
        # The child uses the same monotonic clock; for a rig on another clock the expiry is converted as a time
        # difference.
        expires_ns = time.monotonic_ns() + (command.expires_ns - now)
        twist = (*sent.twist.linear_m_s, *sent.twist.angular_rad_s)
        if not child.send(pack_command(Command(twist, sent.acceleration_m_s2, expires_ns))):
            raise DeviceTimeout(self._name, "its process does not take commands", remedy="disarm and arm again")
        return sent

    # -- inside -------------------------------------------------------------------------------------------

    def _stop_by_dashboard(self) -> None:
        asked = "the driver asked the controller's dashboard to stop the program"
        confirmed = stop_by_dashboard(self.options.host)
        if confirmed or not self._stop_result:
            self._stop_result = f"{asked}, and it {'confirmed that' if confirmed else 'did not confirm it'}"

    def _commandable(self) -> Child:
        child = self._armed_child
        if child is None or child.ended is not None or child is not self._child:
            raise ConnectionLost(
                self._name, "the connection was lost since it was armed", remedy="disarm and arm again"
            )
        state = child.state
        if state is not None and not state.safety_bits & NORMAL_BIT:
            what = "in protective stop" if state.safety_bits & PROTECTIVE_BIT else "stopped for safety"
            raise DeviceFault(
                self._name,
                what,
                remedy="look why, then disarm and arm again",
                code=f"safety bits {state.safety_bits:#x}",
            )
        if state is not None and state.t_ns > self._armed_ns and state.runtime_state != PLAYING:
            remedy = "see the pendant's log, then disarm and arm again"
            raise DeviceFault(self._name, "its control program has stopped", remedy=remedy, code=state.runtime_state)
        return child

    def _living(self) -> Child:
        child = self._child
        if child is None or child.ended is not None:
            raise DeviceFault(self._name, "is not connected at present", remedy="wait for it to come back")
        return child

    def _started(self) -> Child:
        """Return a child that has connected and sent a state. Raises ConnectFailed."""
        child = Child(self._name, self.options.model_dump())
        try:
            deadline = time.monotonic() + self.options.connect_timeout_s
            reply = child.await_reply(self.options.connect_timeout_s)
            if reply.problem:
                raise ConnectFailed(self._name, reply.problem, remedy=reply.remedy)
            while child.state is None and child.ended is None and time.monotonic() < deadline:
                self._closing.wait(0.002)
            if child.state is None:
                raise ConnectFailed(self._name, f"{self.options.host} sends no state", remedy="see whether it runs")
        except BaseException as error:
            child.close()
            if isinstance(error, DeviceError) and not isinstance(error, ConnectFailed):
                where = f"at {self.options.host}: {error.problem}"
                raise ConnectFailed(self._name, where, remedy=error.remedy) from error
            raise
        return child

    def _keep(self) -> None:
        """Watch the child; if it ends, report it once and start another one."""
        pause_s = RECONNECT_S[0]
        while not self._closing.wait(0.02):
            child = self._child
            if child is None or child.ended is None:
                pause_s = RECONNECT_S[0]
                continue
            self._fault = child.error()
            if self._guard.state is Lifecycle.ARMED and child is self._armed_child:
                self._stop_by_dashboard()
            child.close()
            while not self._closing.wait(pause_s):
                try:
                    fresh = self._started()
                except DeviceError:
                    pause_s = min(2 * pause_s, RECONNECT_S[1])
                    continue
                self._child = fresh
                if self._closing.is_set():
                    # close() may have stopped waiting for this thread.
                    fresh.close()
                break


def _arm_state(state: State) -> ArmState:
    return ArmState(
        t_ns=state.t_ns,
        seq=state.seq,
        tcp_pose=Pose((state.pose[0], state.pose[1], state.pose[2]), quaternion(state.pose[3:])),
        tcp_twist=Twist(
            (state.speed[0], state.speed[1], state.speed[2]), (state.speed[3], state.speed[4], state.speed[5])
        ),
        protective_stop=not state.safety_bits & NORMAL_BIT,
    )


def quaternion(vector: tuple[float, ...]) -> Quaternion:
    """Return the quaternion x, y, z, w of a rotation vector (rad)."""
    angle = math.sqrt(sum(v * v for v in vector))
    if angle < 1e-12:
        return 0.0, 0.0, 0.0, 1.0
    scale = math.sin(angle / 2) / angle
    return vector[0] * scale, vector[1] * scale, vector[2] * scale, math.cos(angle / 2)


def _limited(vector: tuple[float, float, float], limit: float) -> tuple[float, float, float]:
    size = math.sqrt(sum(v * v for v in vector))
    if size <= limit:
        return vector
    return vector[0] * limit / size, vector[1] * limit / size, vector[2] * limit / size


def stop_by_dashboard(host: str) -> bool:
    """Command the controller to stop its program, in bounded time; return whether it confirmed."""
    try:
        with socket.create_connection((host, DASHBOARD_PORT), DASHBOARD_S) as link:
            link.settimeout(DASHBOARD_S)
            link.recv(256)
            link.sendall(b"stop\n")
            return link.recv(256).startswith(b"Stopped")
    except OSError:
        return False
