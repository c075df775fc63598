"""The serial face: a pseudo-terminal behind a symbolic link that a client opens like any port."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import hashlib
import os
import socket
import termios
import tty
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from lsds.errors import ConnectFailed
from lsds_mocks.wire.robotiq.line import SerialLine

if TYPE_CHECKING:
    from lsds_mocks.wire.robotiq.reactor import Reactor

NAME = "pty"
_SPEEDS = slice(4, 6)
"""Input and output speed in the list of a terminal's settings."""


class TerminalFace:
    """One pseudo-terminal. Both ends are raw; the mock holds the far end open, so that clients may come and go.

    Bytes at another baud rate than `baud` are noise to the gripper and are not received; 0, or a rate that a terminal
    does not know: any rate.
    A pseudo-terminal does not keep the parity that a client sets, so a wrong one is not noticed.

    Like a real port it can be opened by several programs, and a program that opens it exclusively (pyserial's
    `exclusive=True`) excludes others that also open it exclusively.
    """

    name = NAME

    def __init__(
        self, mock: str, link: str, reactor: Reactor, make: Callable[[Callable[[bytes], None]], SerialLine], baud: int
    ):
        self._mock = mock
        self._link = Path(link) if link else None
        self._reactor = reactor
        self._make = make
        self._speed = getattr(termios, f"B{baud}", None) if baud else None
        self._claim: socket.socket | None = None
        self._near = self._far = -1
        self._line: SerialLine | None = None

    @property
    def address(self) -> str:
        """The path that a client opens."""
        return str(self._link.absolute()) if self._link is not None else os.ttyname(self._far)

    @property
    def up(self) -> bool:
        """Whether it can be opened."""
        return self._near >= 0

    def claim(self) -> None:
        """Reserve the link's name for this process. Raises ConnectFailed if another mock or a file has it.

        The reservation is a socket in the abstract namespace, which always ends with the process.
        """
        if self._link is None or not hasattr(socket, "AF_UNIX"):
            return
        claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            with contextlib.suppress(FileNotFoundError):
                name = hashlib.sha256(os.fsencode(self._link.absolute())).hexdigest()
                claim.bind(f"\0lsds-mock-pty-{name}")
        except OSError as error:
            claim.close()
            raise self._refused("another mock has it") from error
        self._claim = claim
        if self._link.exists() and not self._link.is_symlink():
            raise self._refused("there is a file of that name")

    def open(self) -> None:
        """Make the terminal and its link. Raises ConnectFailed."""
        try:
            self._near, self._far = os.openpty()
            tty.setraw(self._far)
            tty.setraw(self._near)
            os.set_blocking(self._near, False)
            if self._speed is not None:
                settings = termios.tcgetattr(self._far)
                settings[_SPEEDS] = [self._speed, self._speed]
                termios.tcsetattr(self._far, termios.TCSANOW, settings)
            if self._link is not None:
                self._link.unlink(missing_ok=True)
                self._link.symlink_to(os.ttyname(self._far))
        except OSError as error:
            self.drop()
            raise self._refused(error.strerror or str(error)) from error
        self._line = self._make(self._send)
        self._reactor.watch(self._near, self._readable)

    def hold(self, taken: bool) -> None:
        """Occupy the port as another program would (True), or free it. Does nothing while a client has it open."""
        if self.up:
            with contextlib.suppress(OSError):
                fcntl.flock(self._far, (fcntl.LOCK_EX | fcntl.LOCK_NB) if taken else fcntl.LOCK_UN)

    def drop(self) -> None:
        """Remove link and terminal, as if the cable was unplugged."""
        if self._line is not None:
            self._line.hang_up()
            self._reactor.unwatch(self._near)
            self._line = None
        if self._link is not None and self._far >= 0 and self._link.is_symlink():
            with contextlib.suppress(OSError):
                self._link.unlink()
        for fd in (self._near, self._far):
            if fd >= 0:
                os.close(fd)
        self._near = self._far = -1

    def close(self) -> None:
        """Release all resources."""
        self.drop()
        if self._claim is not None:
            self._claim.close()
            self._claim = None

    def _readable(self) -> None:
        try:
            data = os.read(self._near, 4096)
        except OSError as error:
            if error.errno in (errno.EAGAIN, errno.EIO):
                return
            raise
        if self._line is not None and self._same_rate():
            self._line.receive(data)

    def _same_rate(self) -> bool:
        """Return whether the client sends at the gripper's baud rate."""
        return self._speed is None or termios.tcgetattr(self._near)[_SPEEDS] == [self._speed, self._speed]

    def _send(self, data: bytes) -> None:
        # A client that does not read fills the terminal's buffer; further data is lost, as on a line.
        with contextlib.suppress(OSError):
            os.write(self._near, data)

    def _refused(self, why: str) -> ConnectFailed:
        return ConnectFailed(self._mock, f"cannot make {self._link}: {why}", remedy="choose another --pty")
