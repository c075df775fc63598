"""Register layout of a Robotiq gripper. Bytes are counted from 0, as in the manuals.

Instruction manuals of the Hand-E and the 2F series, "Control": command bytes start at register 1000, status bytes at
register 2000, most significant byte first. Of each block, six bytes have a meaning and ten are reserved.
"""

from __future__ import annotations

from enum import IntEnum

COMMAND_REGISTER, STATUS_REGISTER = 1000, 2000
BYTES = 16
"""Size of each block: eight registers."""

ACTION_OFFSET, POSITION_OFFSET, SPEED_OFFSET, FORCE_OFFSET = 0, 3, 4, 5
"""Offsets of action, position, speed and force in the command block."""

ACT, GTO, ATR, ARD = 0x01, 0x08, 0x10, 0x20
"""Bits of the action byte: activate, go to, automatic release, and its direction (set: opening)."""


class Activation(IntEnum):
    """gSTA."""

    RESET = 0
    ACTIVATING = 1
    ACTIVE = 3


class Detection(IntEnum):
    """gOBJ."""

    MOVING = 0
    OPENING = 1
    CLOSING = 2
    ARRIVED = 3


class Trouble(IntEnum):
    """gFLT."""

    NONE = 0x0
    DELAYED = 0x5
    NOT_ACTIVATED = 0x7
    HOT = 0x8
    SILENCE = 0x9
    UNDER_VOLTAGE = 0xA
    RELEASING = 0xB
    INTERNAL = 0xC
    ACTIVATION = 0xD
    OVER_CURRENT = 0xE
    RELEASED = 0xF


def status_bytes(
    action: int, activation: Activation, detection: Detection, fault: int, echo: int, position: int, current: int
) -> bytes:
    """Return the status block; `fault` is the complete fault byte, with the controller's code in the high nibble."""
    first = (action & (ACT | GTO)) | activation << 4 | detection << 6
    return bytes((first, 0, fault, echo, position, current)).ljust(BYTES, b"\0")
