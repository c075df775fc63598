"""The gripper's Modbus RTU: extracts frames from a byte stream and answers requests.

Modbus over serial line V1.02. The gripper sends no Modbus exceptions: it ignores requests that it does not support.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from lsds_mocks.wire.robotiq.layout import BYTES, COMMAND_REGISTER, STATUS_REGISTER

if TYPE_CHECKING:
    from lsds_mocks.wire.robotiq.machine import RegisterMachine

GAP_NS = 10_000_000
"""Pause that ends a frame (ns). 3.5 characters take 0.3 ms on a line; a pseudo-terminal under load pauses longer."""
LONGEST_RTU_FRAME = 256
"""Maximum length of a frame, bytes (Modbus over serial line, "RTU frame")."""
READ_HOLDING = 3
"""Modbus function code: read holding registers."""
READ_INPUT = 4
"""Modbus function code: read input registers."""
WRITE_ONE = 6
"""Modbus function code: write a single register."""
WRITE_MANY = 16
"""Modbus function code: write multiple registers."""
READ_WRITE = 23
"""Modbus function code: read and write multiple registers."""


def crc(data: bytes) -> bytes:
    """Return the CRC-16 of a frame, low byte first."""
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ 0xA001 if value & 1 else value >> 1
    return value.to_bytes(2, "little")


class Deframer:
    """Extracts requests from the received bytes; after a damaged frame it waits until the line is silent.

    `damaged` receives the bytes that are discarded.
    """

    def __init__(self, damaged: Callable[[bytes], None] = lambda _: None) -> None:
        self._damaged = damaged
        self._buffer = bytearray()
        self._deaf = False
        self._last_ns = 0

    def feed(self, data: bytes, now_ns: int) -> list[bytes]:
        """Add bytes received at a time; return the valid requests that they complete."""
        if now_ns - self._last_ns >= GAP_NS:
            if self._buffer:
                self._damaged(bytes(self._buffer))
            self._buffer.clear()
            self._deaf = False
        self._last_ns = now_ns
        if self._deaf:
            return []
        self._buffer += data
        frames = []
        while (length := _length(self._buffer)) is not None:
            if 0 < length <= LONGEST_RTU_FRAME and len(self._buffer) < length:
                break
            frame = bytes(self._buffer[:length])
            if not 0 < length <= LONGEST_RTU_FRAME or crc(frame[:-2]) != frame[-2:]:
                self._damaged(bytes(self._buffer))
                self._buffer.clear()
                self._deaf = True
                break
            frames.append(frame)
            del self._buffer[:length]
        return frames


def _length(buffer: bytearray) -> int | None:
    """Return the length of the request at the buffer's start; None if it is still unknown, 0 for an invalid request."""
    if len(buffer) < 2:
        return None
    function = buffer[1]
    if function in (READ_HOLDING, READ_INPUT, WRITE_ONE):
        return 8
    counts_at = {WRITE_MANY: 6, READ_WRITE: 10}.get(function)
    if counts_at is None:
        return 0
    if len(buffer) <= counts_at:
        return None
    return counts_at + 1 + buffer[counts_at] + 2


def answer(frame: bytes, slave: int, machine: RegisterMachine, now_ns: int) -> bytes | None:
    """Execute a valid request; return the frame of the answer, or None for no answer."""
    if frame[0] != slave:
        return None
    machine.heard(now_ns)
    function, body = frame[1], frame[2:-2]
    first, count = _word(body, 0), _word(body, 2)
    if function in (READ_HOLDING, READ_INPUT):
        reply = _read(first, count, machine, now_ns)
    elif function == WRITE_ONE:
        reply = body if _write(first, 1, body[2:], machine, now_ns) else None
    elif function == WRITE_MANY:
        reply = body[:4] if _write(first, count, body[5:], machine, now_ns) else None
    else:
        written = _readable(first, count) and _write(_word(body, 4), _word(body, 6), body[9:], machine, now_ns)
        reply = _read(first, count, machine, now_ns) if written else None
    if reply is None:
        return None
    message = bytes((slave, function)) + reply
    return message + crc(message)


def meaning(frame: bytes, slave: int) -> str:
    """Return a valid request in words: `write 1000 1001: 0x0900 0x00FF`; with the address if it is another slave's."""
    function, body = frame[1], frame[2:-2]
    first, count = _word(body, 0), _word(body, 2)
    if function in (READ_HOLDING, READ_INPUT):
        text = f"read {_registers(first, count)}"
    elif function == WRITE_ONE:
        text = f"write {first}: {_values(body[2:])}"
    elif function == WRITE_MANY:
        text = f"write {_registers(first, count)}: {_values(body[5:])}"
    else:
        written = _registers(_word(body, 4), _word(body, 6))
        text = f"read {_registers(first, count)}, write {written}: {_values(body[9:])}"
    return text if frame[0] == slave else f"slave {frame[0]}: {text}"


def _registers(first: int, count: int) -> str:
    # A request may name 65535 registers; more than fit into a frame are not listed.
    return " ".join(str(first + i) for i in range(min(count, LONGEST_RTU_FRAME)))


def _values(data: bytes) -> str:
    return " ".join(f"0x{_word(data, at):04X}" for at in range(0, len(data), 2))


def _word(body: bytes, at: int) -> int:
    return int.from_bytes(body[at : at + 2], "big")


def _readable(first: int, count: int) -> bool:
    return first >= STATUS_REGISTER and count > 0 and first + count <= STATUS_REGISTER + BYTES // 2


def _read(first: int, count: int, machine: RegisterMachine, now_ns: int) -> bytes | None:
    if not _readable(first, count):
        return None
    offset = 2 * (first - STATUS_REGISTER)
    return bytes((2 * count,)) + machine.status(now_ns)[offset : offset + 2 * count]


def _write(first: int, count: int, data: bytes, machine: RegisterMachine, now_ns: int) -> bool:
    fits = first >= COMMAND_REGISTER and first + count <= COMMAND_REGISTER + BYTES // 2
    if not (fits and count > 0 and len(data) == 2 * count):
        return False
    machine.write(2 * (first - COMMAND_REGISTER), data, now_ns)
    return True
