"""The string protocol that Robotiq's URCap serves on the robot's controller: GET and SET of named variables."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from lsds_mocks.wire.http_request import is_http_request
from lsds_mocks.wire.robotiq import layout

if TYPE_CHECKING:
    from lsds_mocks.wire.robotiq.machine import RegisterMachine

LONGEST_URCAP_LINE = 1024
"""Maximum length of an unfinished line, bytes; a longer one is discarded; chosen."""

_BITS = {"ACT": layout.ACT, "GTO": layout.GTO, "ATR": layout.ATR, "ADR": layout.ARD, "ARD": layout.ARD}
_BYTES = {"POS": layout.POSITION_OFFSET, "SPE": layout.SPEED_OFFSET, "FOR": layout.FORCE_OFFSET}


class UrcapSession:
    """One client's session. After an HTTP request the client is ignored, because its body could contain commands."""

    def __init__(
        self, machine: RegisterMachine, note: Callable[[bytes, str], None] = lambda _data, _text: None
    ) -> None:
        self._machine = machine
        self._note = note
        self._buffer = b""
        self._ignored = False

    def feed(self, data: bytes, now_ns: int) -> bytes:
        """Receive data; return all answers in one piece, because clients read once without framing."""
        *lines, self._buffer = (self._buffer + data).split(b"\n")
        self._ignored = self._ignored or is_http_request(self._buffer[:LONGEST_URCAP_LINE].decode("ascii", "replace"))
        if len(self._buffer) > LONGEST_URCAP_LINE:
            self._buffer = b""
        return b"".join(self._carry_out(line, now_ns) for line in lines)

    def _carry_out(self, line: bytes, now_ns: int) -> bytes:
        text = line.decode("ascii", "replace")
        self._note(line + b"\n", text.strip())
        return self._answer(text, now_ns)

    def _answer(self, line: str, now_ns: int) -> bytes:
        words = line.split()
        self._ignored = self._ignored or is_http_request(line)
        if self._ignored or not words:
            return b""
        self._machine.heard(now_ns)
        if words[0] == "GET" and len(words) == 2:
            value = self._get(words[1], now_ns)
            return f"{words[1]} {'?' if value is None else value}\n".encode("ascii", "replace")
        if words[0] == "SET" and self._set(words[1:], now_ns):
            return b"ack"
        return b"?\n"

    def _get(self, name: str, now_ns: int) -> int | None:
        command, status = self._machine.command, self._machine.status(now_ns)
        if name in _BITS:
            return int(bool(command[layout.ACTION_OFFSET] & _BITS[name]))
        if name in ("SPE", "FOR"):
            return command[_BYTES[name]]
        values = {
            "STA": status[0] >> 4 & 3,
            "OBJ": status[0] >> 6,
            "FLT": status[2] & 0x0F,
            "PRE": status[3],
            "POS": status[4],
        }
        return values.get(name)

    def _set(self, words: list[str], now_ns: int) -> bool:
        """Write all pairs at once, or none if one of them is invalid; return whether they were written."""
        block = bytearray(self._machine.command)
        if not words or len(words) % 2:
            return False
        for name, text in zip(words[::2], words[1::2], strict=True):
            if not (text.isascii() and text.isdigit() and len(text) <= 3):
                return False
            value = int(text)
            if name in _BITS and value <= 1:
                block[layout.ACTION_OFFSET] = block[layout.ACTION_OFFSET] & ~_BITS[name] | (_BITS[name] if value else 0)
            elif name in _BYTES and value <= 255:
                block[_BYTES[name]] = value
            else:
                return False
        self._machine.write(0, bytes(block), now_ns)
        return True
