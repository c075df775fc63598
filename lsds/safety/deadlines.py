"""The `[deadlines]` table: how long a call of a device or an algorithm may take before it counts as hanging."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from lsds.safety.device_calls import Call

#: Time limit of a call under the virtual clock (s of real time): a busy machine is no fault.
VIRTUAL_S = 60.0
#: Time limit for connecting a cell, which may start every mock in a separate process (s).
CELL_S = 60.0
#: Time limit for closing a cell, in units of that of one device: it may end every mock.
CELL_CLOSINGS = 5
#: Time limit of `stop` of all devices together under the wall clock (s).
CELL_STOP_S = 1.0


class DeadlineOptions(BaseModel):
    """Options of the `[deadlines]` table, in seconds of real time. The error for a call that hangs names it."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    connect_s: float = Field(default=15.0, gt=0, le=3600, description="time limit of a device's connect")
    arm_s: float = Field(
        default=20.0, gt=0, le=3600, description="time limit of a device's arm: a gripper may home for so long"
    )
    call_s: float = Field(
        default=5.0, gt=0, le=3600, description="time limit of one read, command or update while the cell runs"
    )
    close_s: float = Field(default=2.0, gt=0, le=3600, description="time limit of a device's close")


class Deadlines:
    """The deadlines of a rig's calls, as marks for `Calls`."""

    def __init__(self, options: DeadlineOptions, *, virtual: bool) -> None:
        given = options.model_fields_set
        self._connect_s, self._arm_s, self._close_s = options.connect_s, options.arm_s, options.close_s
        self._call_s = VIRTUAL_S if virtual and "call_s" not in given else options.call_s
        self._cell_s = options.connect_s if "connect_s" in given else max(CELL_S, options.connect_s)

    def of(self, who: str, name: str) -> Call:
        """Return the mark of one call, for example of "gripper 'hand-e'" and "connect"."""
        if name == "stop":
            return Call(who, name, CELL_STOP_S)
        if name == "connect" and who.startswith("cell "):
            return Call(who, name, self._cell_s, "deadlines.connect_s")
        if name == "close" and who.startswith("cell "):
            return Call(who, name, CELL_CLOSINGS * self._close_s, "deadlines.close_s")
        named = {"connect": self._connect_s, "arm": self._arm_s, "close": self._close_s, "disarm": self._close_s}
        key = name if name in named else "call"
        return Call(who, name, named.get(name, self._call_s), f"deadlines.{'close' if key == 'disarm' else key}_s")
