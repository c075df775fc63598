"""Faults of an arm."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import Any

from lsds.clock import nanoseconds
from lsds.contracts import ArmCommand, ArmState, Twist
from lsds.errors import DeviceTimeout
from lsds_mocks.faults.made import fault
from lsds_mocks.faults.plan import Around, Plan

NAME = "arm"
_LONG_S = 0.1


class _ProtectiveStop(Around):
    """The controller has stopped the arm, and takes no command."""

    def __init__(self, part: Any, plan: Plan) -> None:
        super().__init__(part, plan)
        self._stopped = False

    def read(self) -> ArmState:
        """Return the newest state."""
        if self._plan.on and not self._stopped:
            self._stopped = True
            self._part.stop()
        state: ArmState = self._part.read()
        return replace(state, protective_stop=True) if self._plan.on else state

    def command(self, command: ArmCommand) -> ArmCommand:
        """Send a command; while the fault is on it is only taken."""
        if self._plan.on:
            return command
        sent: ArmCommand = self._part.command(command)
        return sent


class _Frozen(Around):
    """The stream of its states stands still, the arm does not."""

    _last: ArmState | None = None

    def read(self) -> ArmState:
        """Return the state of when the fault began."""
        state: ArmState = self._part.read()
        if not self._plan.on:
            return state
        self._last = state if self._last is None else self._last
        return self._last


class _Lags(Around):
    def __init__(self, part: Any, plan: Plan) -> None:
        super().__init__(part, plan)
        self._waiting: deque[tuple[int, ArmCommand]] = deque()

    def read(self) -> ArmState:
        """Return the newest state, after what has waited was sent."""
        self._send()
        state: ArmState = self._part.read()
        return state

    def command(self, command: ArmCommand) -> ArmCommand:
        """Keep a command back for a time."""
        if not self._plan.on:
            sent: ArmCommand = self._part.command(command)
            return sent
        self._waiting.append((self._plan.clock.now() + nanoseconds(self._plan.level), command))
        self._send()
        return command

    def stop(self) -> None:
        """Stop: nothing that waits is sent any more."""
        self._waiting.clear()
        self._part.stop()

    def _send(self) -> None:
        now = self._plan.clock.now()
        while self._waiting and self._waiting[0][0] <= now:
            _, command = self._waiting.popleft()
            self._part.command(replace(command, expires_ns=now + nanoseconds(_LONG_S)))


class _Slow(Around):
    def command(self, command: ArmCommand) -> ArmCommand:
        """Send a command, slowed down; it is said to have been sent as it was."""
        if not self._plan.on:
            sent: ArmCommand = self._part.command(command)
            return sent
        x, y, z = (self._plan.level * v for v in command.twist.linear_m_s)
        rx, ry, rz = (self._plan.level * v for v in command.twist.angular_rad_s)
        self._part.command(replace(command, twist=Twist((x, y, z), (rx, ry, rz))))
        return command


class _Gone(Around):
    def read(self) -> ArmState:
        """Return the newest state. Raises DeviceTimeout once the arm is gone."""
        self._require()
        state: ArmState = self._part.read()
        return state

    def command(self, command: ArmCommand) -> ArmCommand:
        """Send a command. Raises DeviceTimeout once the arm is gone."""
        self._require()
        sent: ArmCommand = self._part.command(command)
        return sent

    def _require(self) -> None:
        if self._plan.on:
            raise DeviceTimeout(NAME, "it does not answer any more", remedy="check its network")


protective_stop = fault(_ProtectiveStop, "arm:protective_stop")
frozen = fault(_Frozen, "arm:frozen")
lags = fault(_Lags, "arm:lags")
slow = fault(_Slow, "arm:slow")
gone = fault(_Gone, "arm:gone")
