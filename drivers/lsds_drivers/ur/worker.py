"""The child process that runs ur_rtde.

It is separate because ur_rtde 1.6.5 crashes its process when the controller's stream stalls for about
three seconds. Started as `python -m lsds_drivers.ur.worker`; standard input is the socket to the driver. If the driver
ends, or the stream stalls for long, the child tries to stop the arm and ends.
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import signal
import socket
import sys
import threading
import time
from typing import Any

from lsds_drivers.ur.clock_map import ClockMap
from lsds_drivers.ur.motion_seen import MotionSeen
from lsds_drivers.ur.packets import (
    LARGEST_PACKET,
    Command,
    Kind,
    Reply,
    State,
    pack_reply,
    pack_state,
    unpack_command,
    unpack_request,
)

STATE_LOOK_S = 0.001
"""Sleep between checks for a new state and for a command to renew."""

RESEND_NS = 20_000_000
"""Interval of sending the present command again, which also feeds the watchdog."""

STALLED_NS = 2_000_000_000
"""After this time without a new time stamp the child ends, before ur_rtde would crash it."""

SPEED_T_S = 0.002
"""Argument `t` of `speedL`, after which the function returns (s): one cycle of the controller."""

SETTLES_NS = 300_000_000
"""Time that a stopping arm may show no deceleration, and an arm at rest may show motion."""

RESTS_NS = 80_000_000
"""Time for which all states must show the arm at rest before it counts as at rest."""

REFUSES_NS = 200_000_000
"""Time allowed after a refused motion until a state shows the reason: the program has ended, or the robot has
stopped."""

_STILL = [0.0] * 6

ROBOT_RUNNING = 7
"""RTDE robot mode of an arm that can move."""
PROGRAM_STOPPED = 1
"""RTDE runtime state of a program that has ended."""
PROGRAM_PLAYING = 2
"""RTDE runtime state of a program that runs."""
NORMAL_BIT = 1
"""Bit of the RTDE safety status: normal mode."""
PROTECTIVE_BIT = 4
"""Bit of the RTDE safety status: protective stop."""
VARIABLES = ["timestamp", "actual_TCP_pose", "actual_TCP_speed", "robot_mode", "safety_status_bits", "runtime_state"]


class Lost(Exception):
    """Control of the arm is lost: the child ends, and no longer feeds the controller's watchdog."""


class Worker:
    """One arm."""

    def __init__(self, link: socket.socket, options: dict[str, Any]) -> None:
        self._link = link
        self._options = options
        self._clock = ClockMap()
        self._receive: Any = None
        self._control: Any = None
        self._last_s = 0.0
        self._changed_ns = 0
        self._seq = 0
        self._command: Command | None = None
        self._sent_ns = 0
        # Whether the arm was commanded to move and has not been at rest since; time of the command to stop, 0 without
        # one; whether the controller has refused a motion since.
        self._moving, self._halted_ns, self._refused, self._refused_ns = False, 0, False, 0
        self._two_states_ns = 2e9 / options["state_rate_hz"]
        # Whether our program has run since arming; whether it has ended, even if another program runs now.
        self._played = self._ended = False
        self._seen = MotionSeen()

    def run(self) -> None:
        """Serve until the driver requests the end or has ended, or the stream stalls."""
        try:
            from rtde_receive import RTDEReceiveInterface

            self._receive = RTDEReceiveInterface(self._options["host"], self._options["state_rate_hz"], VARIABLES)
        except (RuntimeError, OSError, ImportError) as error:
            self._send(pack_reply(Kind.FAILED, Reply(f"cannot be reached: {_plain(error)}", _REACH)))
            return
        self._changed_ns = time.monotonic_ns()
        self._send(pack_reply(Kind.DONE, Reply()))
        # States have their own thread, so that they continue while a call to the controller blocks.
        threading.Thread(target=self._watch, name="states", daemon=True).start()
        try:
            while self._listen():
                self._drive()
        except Lost as lost:
            self._give_up(str(lost), _PENDANT)
        except Exception as error:
            # An exception of ur_rtde. A regular exit could block in its threads, and the driver would wait.
            self._give_up(f"cannot be driven: {_plain(error)}", _PENDANT)

    # -- the driver's side --------------------------------------------------------------------------------

    def _listen(self) -> bool:
        """Handle messages of the driver; return False at the end."""
        wait_s = STATE_LOOK_S
        while select.select([self._link], [], [], wait_s)[0]:
            wait_s = 0.0
            data = self._link.recv(LARGEST_PACKET)
            if not data or data[0] == Kind.QUIT:
                self._leave()
                return False
            if data[0] == Kind.COMMAND:
                self._command, self._sent_ns = unpack_command(data), 0
            elif data[0] == Kind.STOP:
                self._halt()
            elif data[0] == Kind.ARM:
                self._send(pack_reply(Kind.DONE, self._arm()._replace(request=unpack_request(data))))
            elif data[0] == Kind.DISARM:
                self._disarm()
                self._send(pack_reply(Kind.DONE, Reply(request=unpack_request(data))))
        return True

    def _send(self, data: bytes) -> None:
        with contextlib.suppress(OSError):
            self._link.send(data, socket.MSG_DONTWAIT)

    # -- the controller's side ----------------------------------------------------------------------------

    def _watch(self) -> None:
        """Pass states on; end the process if none have arrived for long."""
        while True:
            time.sleep(STATE_LOOK_S)
            try:
                self._look()
            except Exception as error:
                self._give_up(f"its states cannot be read: {_plain(error)}", "see whether it still runs")
            if time.monotonic_ns() - self._changed_ns > STALLED_NS:
                problem = f"the controller has sent nothing new for {STALLED_NS / 1e9:.0f} s"
                self._give_up(problem, "see whether it still runs")

    def _give_up(self, problem: str, remedy: str) -> None:
        """Report the reason and end: the driver stops the program by the dashboard, the controller by its watchdog."""
        self._send(pack_reply(Kind.FAILED, Reply(problem, remedy)))
        # No regular disconnect: ur_rtde would wait for a controller that does not answer.
        os._exit(1)

    def _look(self) -> None:
        """Pass a new state on."""
        receive = self._receive
        controller_s = receive.getTimestamp()
        if controller_s == self._last_s:
            return
        now = time.monotonic_ns()
        self._last_s, self._changed_ns = controller_s, now
        state = State(
            self._clock.to_monotonic(controller_s, now),
            self._seq,
            tuple(receive.getActualTCPPose()),
            tuple(receive.getActualTCPSpeed()),
            receive.getRobotMode(),
            receive.getSafetyStatusBits(),
            self._runtime(receive.getRuntimeState()),
        )
        self._seq += 1
        self._send(pack_state(state))
        self._seen.judge(state.speed, now)

    def _runtime(self, reported: int) -> int:
        """Return the state of our program; after it has ended, a program of another client may be running."""
        if reported == PROGRAM_PLAYING:
            self._played = True
        elif self._played:
            self._ended = True
        return PROGRAM_STOPPED if self._ended else reported

    def _drive(self) -> None:
        """Send the present command if it is new or has to be renewed; brake if it has expired.

        Raises Lost if the arm is not at rest without a command.
        """
        command, control = self._command, self._control
        if control is None or self._refused or self._ended:
            self._command = None
        if control is None or self._ended:
            # Do not feed the watchdog until the next arming, so that it ends any running program.
            return
        now = time.monotonic_ns()
        if self._refused:
            self._seek_reason(now)
        elif command is None:
            self._rest(control, now)
        elif now >= command.expires_ns:
            self._halt()
        elif now - self._sent_ns >= RESEND_NS:
            if not self._moving:
                self._seen.set_in_motion()
            self._moving, self._halted_ns = True, 0
            self._send_speed(list(command.twist), command.acceleration)

    def _send_speed(self, twist: list[float], acceleration: float) -> None:
        self._sent_ns = time.monotonic_ns()
        taken = self._control.speedL(twist, acceleration, SPEED_T_S)
        if time.monotonic_ns() - self._sent_ns > REFUSES_NS:
            # ur_rtde may have reconnected meanwhile and started a new program without a watchdog.
            raise Lost("took too long to accept a motion")
        if not taken:
            self._refuse()

    def _refuse(self) -> None:
        self._command = None
        if not self._refused:
            self._refused, self._refused_ns = True, time.monotonic_ns()

    def _halt(self) -> None:
        """Start to decelerate. speedStop is unsuitable, because it waits for rest without feeding the watchdog."""
        self._command = None
        if self._control is None or not (self._moving or self._seen.runs_ns):
            return
        if not self._halted_ns:
            self._moving, self._halted_ns = True, time.monotonic_ns()
            self._seen.begin_stop()
        self._send_speed(_STILL, self._options["stop_acceleration_m_s2"])

    def _end_motion(self, control: Any) -> None:
        """End the speed control of an arm at rest, which returns at once."""
        with contextlib.suppress(RuntimeError):
            if control.speedStop(self._options["stop_acceleration_m_s2"]):
                return
        self._refuse()

    def _leave(self) -> None:
        """Decelerate to rest and wait for it; the watchdog is no longer needed."""
        self._command = None
        if self._control is not None and self._moving:
            with contextlib.suppress(RuntimeError):
                self._control.speedStop(self._options["stop_acceleration_m_s2"])

    def _seek_reason(self, now: int) -> None:
        """Check that a motion was refused because the controller has ended the program, or stopped the arm."""
        state = self._receive
        if state.getRuntimeState() != PROGRAM_PLAYING or not state.getSafetyStatusBits() & NORMAL_BIT:
            self._ended = True
        elif now - self._refused_ns > REFUSES_NS + self._two_states_ns:
            raise Lost("refused a motion or a stop without a reason")

    def _rest(self, control: Any, now: int) -> None:
        """Without a command: check that the arm comes to rest and stays there; if so, feed the watchdog."""
        settles_ns, seen = SETTLES_NS + self._two_states_ns, self._seen
        if not self._moving:
            if seen.runs_ns and seen.judged_ns - seen.runs_ns > SETTLES_NS:
                raise Lost("moves without a command")
        elif seen.rests_ns and seen.judged_ns - max(seen.rests_ns, seen.slowed_ns) > RESTS_NS:
            self._moving, self._halted_ns = False, 0
            self._end_motion(control)
        elif now - max(self._halted_ns, seen.judged_ns) > settles_ns:
            # Without states, let the controller's watchdog stop the arm.
            self._ended = True
        elif not seen.rests_ns and now - max(self._halted_ns, seen.slowed_ns) > settles_ns:
            raise Lost("does not slow down after the command to stop")
        if now - self._sent_ns < RESEND_NS:
            return
        if self._moving:
            self._send_speed(_STILL, self._options["stop_acceleration_m_s2"])
        else:
            self._sent_ns = now
            control.kickWatchdog()

    def _arm(self) -> Reply:
        """Make the arm commandable; return the problem that prevents it."""
        refusal = self._refusal()
        if refusal is not None:
            return refusal
        try:
            if self._control is None:
                self._control = self._new_control()
            elif not self._control.isProgramRunning():
                self._control.reuploadScript()
                self._await_program()
            options = self._options
            if options["tcp_offset"] is not None and not self._control.setTcp(options["tcp_offset"]):
                self._disarm()
                return Reply("refuses the TCP offset")
            if options["payload_kg"] is not None:
                self._control.setPayload(options["payload_kg"], options["payload_cog_m"])
            if not self._control.setWatchdog(options["watchdog_hz"]):
                self._disarm()
                return Reply("does not accept its watchdog, without which it could continue to move", _CONTROL)
            self._begin()
        except (RuntimeError, OSError) as error:
            self._disarm()
            return Reply(f"does not grant control: {_plain(error)}", _CONTROL)
        return Reply()

    def _begin(self) -> None:
        """Reset the state; no program is known yet."""
        self._moving, self._halted_ns, self._refused = False, 0, False
        self._played = self._ended = False

    def _refusal(self) -> Reply | None:
        mode, bits = self._receive.getRobotMode(), self._receive.getSafetyStatusBits()
        if mode != ROBOT_RUNNING:
            remedy = "power it on and release the brakes at the pendant, or from its dashboard"
            return Reply(f"is not running (robot mode {mode})", remedy, mode)
        if bits & PROTECTIVE_BIT and self._options["unlock_protective_stop"]:
            return self._unlock()
        if not bits & NORMAL_BIT:
            what = "is in protective stop" if bits & PROTECTIVE_BIT else "is stopped for safety"
            return Reply(what, "look why, clear it at the pendant, and arm again", f"safety bits {bits:#x}")
        return None

    def _unlock(self) -> Reply | None:
        """Unlock a protective stop; the controller allows it five seconds after the stop."""
        from dashboard_client import DashboardClient

        dashboard = DashboardClient(self._options["host"])
        deadline = time.monotonic() + 6.0
        try:
            dashboard.connect()
            dashboard.closeSafetyPopup()
            while True:
                try:
                    dashboard.unlockProtectiveStop()
                    break
                except RuntimeError as error:
                    if "until 5s" not in str(error) or time.monotonic() > deadline:
                        raise
                    time.sleep(0.2)
            while not self._receive.getSafetyStatusBits() & NORMAL_BIT:
                if time.monotonic() > deadline:
                    return Reply("stays in protective stop", "clear it at the pendant")
                time.sleep(0.02)
            return None
        except (RuntimeError, OSError) as error:
            return Reply(f"cannot be unlocked: {_plain(error)}", "clear the protective stop at the pendant")
        finally:
            dashboard.disconnect()

    def _new_control(self) -> Any:
        from rtde_control import RTDEControlInterface as Control

        flags = Control.FLAG_UPLOAD_SCRIPT
        if self._options["upper_registers"]:
            flags |= Control.FLAG_UPPER_RANGE_REGISTERS
        if not self._options["remote_control_check"]:
            flags |= Control.FLAG_DISABLE_REMOTE_CONTROL_CHECK
        return Control(self._options["host"], -1.0, flags)

    def _await_program(self) -> None:
        deadline = time.monotonic() + 5.0
        while not self._control.isProgramRunning():
            if time.monotonic() > deadline:
                raise RuntimeError("its program does not start")
            time.sleep(0.01)

    def _disarm(self) -> None:
        """Release control; the program on the controller ends."""
        self._leave()
        control, self._control = self._control, None
        self._begin()
        if control is not None:
            with contextlib.suppress(RuntimeError):
                control.stopScript()
            with contextlib.suppress(RuntimeError):
                control.disconnect()


_REACH = "check the address, the cable, and that the controller is on"
_PENDANT = "see the pendant, then disarm and arm again"
_CONTROL = "is another client in control (registers in use)? is the arm in remote control?"


def _plain(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def main() -> None:
    """Serve the driver at the other end of standard input."""
    # The driver handles Ctrl-C: it stops the arm and then ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    link = socket.socket(fileno=os.dup(0))
    try:
        Worker(link, json.loads(sys.argv[1])).run()
    finally:
        link.close()


if __name__ == "__main__":
    main()
