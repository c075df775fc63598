"""Register layout of a Robotiq gripper. Bytes are counted from 0, as in the manuals.

Instruction manuals of the Hand-E and the 2F series, "Control": command bytes start at register 1000, status bytes at
register 2000, most significant byte first. Of each block, six bytes have a meaning and ten are reserved.
"""

from __future__ import annotations

from enum import IntEnum

COMMAND_REGISTER = 1000
"""First register of the command block (Robotiq manuals, "Control")."""
STATUS_REGISTER = 2000
"""First register of the status block (Robotiq manuals, "Control")."""
BYTES = 16
"""Size of each block: eight registers."""

ACTION_OFFSET = 0
"""Offset of the action byte in the command block."""
POSITION_OFFSET = 3
"""Offset of the requested position in the command block."""
SPEED_OFFSET = 4
"""Offset of the speed in the command block."""
FORCE_OFFSET = 5
"""Offset of the force in the command block."""

ACT = 0x01
"""Bit of the action byte: activate."""
GTO = 0x08
"""Bit of the action byte: go to."""
ATR = 0x10
"""Bit of the action byte: automatic release."""
ARD = 0x20
"""Bit of the action byte: direction of the automatic release; set means opening."""


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
