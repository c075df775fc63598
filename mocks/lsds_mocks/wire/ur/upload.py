"""A client of a port that accepts scripts."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from lsds_mocks.wire.ur.messages import WARNING, ErrorCode
from lsds_mocks.wire.ur.net import Link, ProtocolEnd
from lsds_mocks.wire.ur.script.stream import ScriptStream
from lsds_mocks.wire.ur.sender import Sender, sender_of

if TYPE_CHECKING:
    from lsds_mocks.wire.ur.controller import Controller

Scripts = Callable[[str, Sender | None], None]
"""Function that receives one program and its sender."""


class Face(Protocol):
    """The owner of the port's clients."""

    def forget(self, link: Link) -> None:
        """Let go of a client."""
        ...


READ_ONLY = 210
"""Error code of a script for a connection that only reads."""


class ScriptSession:
    """One client. `scripts` receives its programs; None for a read-only port.

    A connection that is made in local control only reads, too, and stays so; when local control begins, those that
    may write are closed.
    """

    at_once = 1 << 14

    def __init__(self, face: Face, link: Link, controller: Controller, scripts: Scripts | None) -> None:
        self._face = face
        self._link = link
        self._controller = controller
        self._scripts = scripts
        self._handovers = controller.handovers
        self._stream = ScriptStream()

    def received(self, data: bytes) -> None:
        """Receive script text. Raises ProtocolEnd after an HTTP request."""
        if self._scripts is None:
            return
        for program in self._stream.feed(data):
            self._link.note(program.encode(), program.strip().partition("\n")[0])
            if self._controller.obeys(self._handovers):
                self._scripts(program, sender_of(self._link.socket))
            else:
                self._controller.post_message(ErrorCode(READ_ONLY, 0, WARNING))
        if self._stream.refused:
            raise ProtocolEnd

    def closed(self) -> None:
        """The client is gone."""
        self._face.forget(self._link)
