"""The gripper's six command bytes and six status bytes (Robotiq instruction manuals, "Control")."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple, Self

COMMAND_REGISTER = 0x03E8
"""First register of the command block."""
STATUS_REGISTER = 0x07D0
"""First register of the status block."""

ACTIVATE = 1 << 0
"""Bit rACT of the action byte: activate."""
GO_TO = 1 << 3
"""Bit rGTO of the action byte: go to the requested position."""
RELEASE = 1 << 4
"""Bit rATR of the action byte: automatic release."""
RELEASE_OPENING = 1 << 5
"""Bit rARD of the action byte: the automatic release opens the fingers."""


class Activation(IntEnum):
    """gSTA."""

    RESET = 0
    ACTIVATING = 1
    UNUSED = 2
    ACTIVE = 3


class Detection(IntEnum):
    """gOBJ, which has no meaning while gGTO is 0."""

    MOVING = 0
    CONTACT_OPENING = 1
    CONTACT_CLOSING = 2
    ARRIVED = 3


class Status(NamedTuple):
    """The status block. `fault` is gFLT, `controller_fault` kFLT; `echo`, `position` and `current` are counts."""

    activated: bool
    going: bool
    activation: Activation
    detection: Detection
    fault: int
    controller_fault: int
    echo: int
    position: int
    current: int

    @classmethod
    def from_registers(cls, words: list[int]) -> Self:
        """Return the status that three registers hold, most significant byte first."""
        first, fault, echo = words[0] >> 8, words[1] >> 8, words[1] & 0xFF
        return cls(
            activated=bool(first & 1),
            going=bool(first >> 3 & 1),
            activation=Activation(first >> 4 & 3),
            detection=Detection(first >> 6 & 3),
            fault=fault & 0x0F,
            controller_fault=fault >> 4,
            echo=echo,
            position=words[2] >> 8,
            current=words[2] & 0xFF,
        )


class Motion(NamedTuple):
    """Position, speed and force requests in counts."""

    position: int
    speed: int
    force: int


def command_words(action: int, motion: Motion | None) -> list[int]:
    """Return the registers for an action and a motion; without a motion, only the first register."""
    if motion is None:
        return [action << 8]
    return [action << 8, motion.position, motion.speed << 8 | motion.force]
