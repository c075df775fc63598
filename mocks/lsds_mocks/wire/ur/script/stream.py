"""Splits a byte stream of scripts into programs: a `def` or `sec` up to its `end`, or any other complete line."""

from __future__ import annotations

import re

from lsds_mocks.wire.http_request import is_http_request
from lsds_mocks.wire.ur.script.compiler import LONGEST_PROGRAM

_CLEAN = re.compile(r'"[^"\n]*"|#.*')
_WORD = re.compile(r"[A-Za-z_]\w*")
_OPENS = frozenset(("def", "sec", "thread", "if", "while"))
_BLOCKS = (*_OPENS, "end")
LONG = 2000
"""Length of a line above which only words that open or close a block are examined, characters; chosen."""
LONGEST_SCRIPT_LINE = 100_000
"""Length of a line above which the program is returned without further examination, characters; chosen."""

LIMIT = LONGEST_PROGRAM
"""Length (characters) above which an unfinished program is returned, to be refused."""


class ScriptStream:
    """Splits a client's data into whole programs; `refused` is set after an HTTP request, which is not run."""

    def __init__(self) -> None:
        self.refused = False
        self._partial = b""
        self._lines: list[str] = []
        self._depth = 0
        self._size = 0

    def feed(self, data: bytes) -> list[str]:
        """Return the programs that are now complete. Invalid UTF-8 becomes replacement characters."""
        *complete, self._partial = (self._partial + data).split(b"\n")
        programs = []
        for line in complete:
            text = line.decode("utf-8", "replace")
            self.refused = self.refused or is_http_request(text[:LONG])
            if self.refused:
                self._partial = b""
                break
            program = self._line(text)
            if program is not None:
                programs.append(program)
        self.refused = self.refused or is_http_request(self._partial[:LONG].decode("utf-8", "replace"))
        if len(self._partial) > LIMIT:
            self._partial = b""
        return programs

    def _line(self, line: str) -> str | None:
        words = self._words(line)
        if not self._lines and (not words or words[0] not in ("def", "sec")):
            return line if words else None
        self._lines.append(line)
        self._size += len(line)
        for word in words:
            self._depth += (word in _OPENS) - (word == "end")
        if self._depth > 0 and self._size < LIMIT and not self._is_too_long(line):
            return None
        program = "\n".join(self._lines)
        self._lines, self._depth, self._size = [], 0, 0
        return program

    def _is_too_long(self, line: str) -> bool:
        return len(line) > LONGEST_SCRIPT_LINE and any(word in line for word in _BLOCKS)

    def _words(self, line: str) -> list[str]:
        """Return a line's words without strings and comments; of a long line, only the necessary ones."""
        if len(line) > LONG and not any(word in line for word in _BLOCKS):
            return _WORD.findall(line, 0, LONG)
        return _WORD.findall(_CLEAN.sub(" ", line[:LONGEST_SCRIPT_LINE]))
