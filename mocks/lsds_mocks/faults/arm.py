"""Faults of an arm."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from lsds.contracts import ArmCommand, ArmState, Twist
from lsds.errors import DeviceTimeout
from lsds_mocks.faults.made import fault
from lsds_mocks.faults.moved import Frozen, Later, Moved
from lsds_mocks.faults.plan import Plan

NAME = "arm"
_LONG_S = 0.1
"""Time until a delayed command of the arm expires after it is sent, s; chosen."""


class _ProtectiveStop(Moved):
    """The controller has stopped the arm and accepts no command."""

    def __init__(self, part: Any, plan: Plan) -> None:
        super().__init__(part, plan)
        self._stopped = False

    def read(self) -> ArmState:
        """Return the newest state; the arm stops when the fault begins."""
        if self._plan.on and not self._stopped:
            self._stopped = True
            self._part.stop()
        state: ArmState = super().read()
        return state

    def reported(self, state: ArmState) -> ArmState:
        return replace(state, protective_stop=True)

    def sent(self, command: ArmCommand) -> ArmCommand | None:
        return None


class _Lags(Later):
    _lifetime_s = _LONG_S


class _Slow(Moved):
    """The arm moves more slowly than commanded, but reports the commanded twist as sent."""

    def sent(self, command: ArmCommand) -> ArmCommand | None:
        x, y, z = (self._plan.level * v for v in command.twist.linear_m_s)
        rx, ry, rz = (self._plan.level * v for v in command.twist.angular_rad_s)
        self._part.command(replace(command, twist=Twist((x, y, z), (rx, ry, rz))))
        return None


class _Gone(Moved):
    """The arm answers neither reads nor commands."""

    def reported(self, state: ArmState) -> ArmState:
        raise self._silence()

    def sent(self, command: ArmCommand) -> ArmCommand | None:
        raise self._silence()

    def _silence(self) -> DeviceTimeout:
        return DeviceTimeout(NAME, "it does not answer any more", remedy="check its network")


protective_stop = fault(_ProtectiveStop, "arm:protective_stop")
frozen = fault(Frozen, "arm:frozen")
lags = fault(_Lags, "arm:lags")
slow = fault(_Slow, "arm:slow")
gone = fault(_Gone, "arm:gone")
