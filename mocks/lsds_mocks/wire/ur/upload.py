"""A client of a port that accepts scripts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from lsds_mocks.wire.ur.net import Link, ProtocolEnd
from lsds_mocks.wire.ur.script.stream import ScriptStream
from lsds_mocks.wire.ur.sender import Sender, sender_of

Scripts = Callable[[str, Sender | None], None]
"""Function that receives one program and its sender."""


class Face(Protocol):
    """The owner of the port's clients."""

    def forget(self, link: Link) -> None:
        """Let go of a client."""
        ...


class ScriptSession:
    """One client. `scripts` receives its programs; None for a read-only port."""

    at_once = 1 << 14

    def __init__(self, face: Face, link: Link, scripts: Scripts | None) -> None:
        self._face = face
        self._link = link
        self._scripts = scripts
        self._stream = ScriptStream()

    def received(self, data: bytes) -> None:
        """Receive script text. Raises ProtocolEnd after an HTTP request."""
        if self._scripts is None:
            return
        for program in self._stream.feed(data):
            self._link.note(program.encode(), program.strip().partition("\n")[0])
            self._scripts(program, sender_of(self._link.socket))
        if self._stream.refused:
            raise ProtocolEnd

    def closed(self) -> None:
        """The client is gone."""
        self._face.forget(self._link)
