"""Messages between driver and child: one packet per message on a socket pair. Times are monotonic nanoseconds."""

from __future__ import annotations

import json
import struct
from enum import IntEnum
from typing import Any, NamedTuple

LARGEST_PACKET = 65536
"""Maximum length of a packet, bytes; chosen."""


class Kind(IntEnum):
    """First byte of a packet."""

    COMMAND = 1
    STOP = 2
    ARM = 3
    DISARM = 4
    QUIT = 5
    STATE = 6
    DONE = 7
    FAILED = 8


_REQUEST = struct.Struct("<BI")
_COMMAND = struct.Struct("<B7dq")
_STATE = struct.Struct("<BqQ12d3i")


class Command(NamedTuple):
    """Move with a twist (m/s, rad/s, base frame) until a time."""

    twist: tuple[float, ...]
    acceleration: float
    expires_ns: int


class State(NamedTuple):
    """The last state of the controller, with its `safety_bits` and modes. `pose` contains a rotation vector."""

    t_ns: int
    seq: int
    pose: tuple[float, ...]
    speed: tuple[float, ...]
    robot_mode: int
    safety_bits: int
    runtime_state: int


class Reply(NamedTuple):
    """The result of a request; `problem` is empty on success. `request` is its number, 0 for the initial connection."""

    problem: str = ""
    remedy: str = ""
    code: int | str | None = None
    request: int = 0


def pack_request(kind: Kind, number: int) -> bytes:
    """Return the packet of a request, with the number that its reply will have."""
    return _REQUEST.pack(kind, number)


def unpack_request(data: bytes) -> int:
    """Return its number."""
    number: int = _REQUEST.unpack(data)[1]
    return number


def pack_command(command: Command) -> bytes:
    """Return the packet."""
    return _COMMAND.pack(Kind.COMMAND, *command.twist, command.acceleration, command.expires_ns)


def unpack_command(data: bytes) -> Command:
    """Return what a packet holds."""
    _, *numbers, expires_ns = _COMMAND.unpack(data)
    return Command(tuple(numbers[:6]), numbers[6], expires_ns)


def pack_state(state: State) -> bytes:
    """Return the packet."""
    return _STATE.pack(
        Kind.STATE,
        state.t_ns,
        state.seq,
        *state.pose,
        *state.speed,
        state.robot_mode,
        state.safety_bits,
        state.runtime_state,
    )


def unpack_state(data: bytes) -> State:
    """Return what a packet holds."""
    _, t_ns, seq, *rest = _STATE.unpack(data)
    return State(t_ns, seq, tuple(rest[:6]), tuple(rest[6:12]), *rest[12:])


def pack_reply(kind: Kind, reply: Reply) -> bytes:
    """Return the packet."""
    return bytes([kind]) + json.dumps(reply._asdict()).encode()


def unpack_reply(data: bytes) -> Reply:
    """Return what a packet holds."""
    fields: dict[str, Any] = json.loads(data[1:])
    return Reply(**fields)
