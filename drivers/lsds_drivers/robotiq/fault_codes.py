"""The gripper's fault codes (gFLT) in words, with a remedy for the operator."""

from __future__ import annotations

from typing import NamedTuple

from lsds.errors import DeviceFault

NOT_ACTIVATED = 0x07
"""Code gFLT of a gripper that is not activated (Robotiq manuals, "Control")."""
RELEASING = 0x0B
"""Code gFLT of an automatic release under way (Robotiq manuals, "Control")."""


class Fault(NamedTuple):
    """One fault code. `blocks` means that the gripper executes no commands until an operator has acted."""

    problem: str
    remedy: str
    blocks: bool = True


_REARM = "then disarm() and arm() again; arming closes and opens the fingers"

FAULTS: dict[int, Fault] = {
    0x05: Fault("motion waits until the activation is over", "wait", blocks=False),
    0x07: Fault("it is not activated", "arm() it; activation closes and opens the fingers"),
    0x08: Fault("it is too hot (above 85 °C inside)", "let it cool down; lower force, speed or duty"),
    0x09: Fault("it had no communication for a second", "nothing to do once it answers again", blocks=False),
    0x0A: Fault("its supply voltage is too low", f"check the 24 V supply and the coupling's contacts, {_REARM}"),
    0x0B: Fault("an automatic release is under way", f"wait for its end, {_REARM}"),
    0x0C: Fault("an internal fault", f"switch its power off and on, {_REARM}; call Robotiq if it persists"),
    0x0D: Fault("its activation failed", f"take away what is between or around the fingers, {_REARM}"),
    0x0E: Fault("overcurrent", f"free the fingers and lower the force, {_REARM}"),
    0x0F: Fault("an automatic release has ended", f"take the object away, {_REARM}"),
}


def device_fault(device: str, code: int, controller: int = 0) -> DeviceFault:
    """Return the error for a fault code; `controller` is the fault code of the universal controller (kFLT)."""
    fault = FAULTS.get(code) or Fault("a fault that its manual does not list", f"look at its LED, {_REARM}")
    problem = fault.problem + (f", and its controller reports {controller:#x}" if controller else "")
    return DeviceFault(device, problem, remedy=fault.remedy, code=f"0x{code:02X}")


def blocks(code: int) -> bool:
    """Return whether a fault blocks commands; an unlisted code counts as blocking."""
    fault = FAULTS.get(code)
    return code != 0 and (fault is None or fault.blocks)
