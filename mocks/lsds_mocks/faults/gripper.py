"""Faults of a gripper: of its line, its electronics, its fingers and its reported state."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from lsds.contracts import GripperCommand, GripperState
from lsds.errors import DeviceError, DeviceFault, DeviceTimeout, ProtocolFault
from lsds_mocks.faults.made import fault
from lsds_mocks.faults.moved import Frozen, Later, Moved
from lsds_mocks.faults.plan import Plan

NAME = "gripper"
OVER_CURRENT = 0x0E
"""Code gFLT of an over-current, as `Trouble.OVER_CURRENT` of the Robotiq mock."""


class _Line(Moved):
    """A share of the reads and commands fails with an error."""

    def error(self) -> DeviceError:
        return DeviceTimeout(NAME, "no answer within 0.1 s", remedy="check the cable and the power")

    def reported(self, state: GripperState) -> GripperState:
        if self._plan.happens():
            raise self.error()
        return state

    def sent(self, command: GripperCommand) -> GripperCommand | None:
        if self._plan.happens():
            raise self.error()
        return command


class _Crc(_Line):
    def error(self) -> DeviceError:
        return ProtocolFault(NAME, "an answer has a wrong check sum", remedy="check the cable and its shield")


class _Refuses(Moved):
    def sent(self, command: GripperCommand) -> GripperCommand | None:
        raise ProtocolFault(NAME, "it refuses the command", code=2, remedy="check its register map")


class _Still(Moved):
    """The fingers stand still once the fault is on; the gripper still reports the commanded aperture as its target."""

    def __init__(self, part: Any, plan: Plan) -> None:
        super().__init__(part, plan)
        self._stands = False
        self._commanded_m: float | None = None

    def stand(self) -> None:
        """Stop the fingers where they are, once."""
        if not self._stands:
            self._stands = True
            self._part.stop()

    def read(self) -> GripperState:
        """Return the newest state; the fingers stop when the fault begins."""
        if self._plan.on:
            self.stand()
        state: GripperState = super().read()
        return state

    def sent(self, command: GripperCommand) -> GripperCommand | None:
        self.stand()
        self._commanded_m = command.aperture_m
        return None

    def reported(self, state: GripperState) -> GripperState:
        return state if self._commanded_m is None else replace(state, target_m=self._commanded_m)


class _OwnFault(_Still):
    def reported(self, state: GripperState) -> GripperState:
        raise DeviceFault(NAME, "over-current", code=OVER_CURRENT, remedy="let it cool down and activate it again")


class _NoPower(_Still):
    def read(self) -> GripperState:
        """Return the newest state. Raises DeviceTimeout without power."""
        if self._plan.on:
            self.stand()
            raise DeviceTimeout(NAME, "no answer within 0.1 s", remedy="check the cable and the power")
        state: GripperState = super().read()
        return state

    def sent(self, command: GripperCommand) -> GripperCommand | None:
        self.stand()
        raise DeviceTimeout(NAME, "no answer within 0.1 s", remedy="check the cable and the power")


class _Lies(_Still):
    """The fingers stand still, but the gripper reports the commanded aperture as reached."""

    def reported(self, state: GripperState) -> GripperState:
        claimed_m = state.aperture_m if self._commanded_m is None else self._commanded_m
        return replace(state, aperture_m=claimed_m, target_m=claimed_m, moving=False)


class _Offset(Moved):
    def reported(self, state: GripperState) -> GripperState:
        return replace(state, aperture_m=state.aperture_m + self._plan.level)


class _Slow(Moved):
    def sent(self, command: GripperCommand) -> GripperCommand | None:
        return replace(command, speed_m_s=command.speed_m_s * self._plan.level)


class _Weak(Moved):
    def sent(self, command: GripperCommand) -> GripperCommand | None:
        return replace(command, force_n=command.force_n * self._plan.level)


class _Coarse(Moved):
    def sent(self, command: GripperCommand) -> GripperCommand | None:
        return replace(command, aperture_m=round(command.aperture_m / self._plan.level) * self._plan.level)


class _Loses(Moved):
    def sent(self, command: GripperCommand) -> GripperCommand | None:
        return None if self._plan.happens() else command


time_out = fault(_Line, "gripper:time_out")
crc = fault(_Crc, "gripper:crc")
refuses = fault(_Refuses, "gripper:refuses")
own_fault = fault(_OwnFault, "gripper:own_fault")
no_power = fault(_NoPower, "gripper:no_power")
offset = fault(_Offset, "gripper:offset")
slow = fault(_Slow, "gripper:slow")
weak = fault(_Weak, "gripper:weak")
late = fault(Later, "gripper:late")
coarse = fault(_Coarse, "gripper:coarse")
loses = fault(_Loses, "gripper:loses")
stuck = fault(_Still, "gripper:stuck")
lies = fault(_Lies, "gripper:lies")
frozen = fault(Frozen, "gripper:frozen")
