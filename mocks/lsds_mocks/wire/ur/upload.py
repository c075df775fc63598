"""A client of a port that accepts scripts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from lsds_mocks.wire.ur.net import Link
from lsds_mocks.wire.ur.script.stream import ScriptStream


class Face(Protocol):
    """Who keeps the port's clients."""

    def forget(self, link: Link) -> None:
        """Let go of a client."""
        ...


class ScriptSession:
    """One client. `scripts` takes the programs it uploads; None where the port is read-only."""

    at_once = 1 << 14

    def __init__(self, face: Face, link: Link, scripts: Callable[[str], None] | None) -> None:
        self._face = face
        self._link = link
        self._scripts = scripts
        self._stream = ScriptStream()

    def received(self, data: bytes) -> None:
        """Take script text."""
        if self._scripts is not None:
            for program in self._stream.feed(data):
                self._scripts(program)

    def closed(self) -> None:
        """The client is gone."""
        self._face.forget(self._link)
