"""Non-blocking network input and output, performed once per control cycle."""

from __future__ import annotations

import contextlib
import errno
import select
import socket
from collections import deque
from collections.abc import Callable, Collection
from typing import TYPE_CHECKING, Protocol

from lsds.errors import ConnectFailed
from lsds_mocks.wire.address import ACCEPT_QUEUE
from lsds_mocks.wire.faults import FaultInjector

if TYPE_CHECKING:
    from lsds.clock import Clock
    from lsds_mocks.wire.journal import Journal, Meaning

BACKLOG_BYTES = 1 << 18
"""Unsent bytes above which a client that does not read loses new packages."""

LONGEST_BYTES = 1 << 20
"""Unsent bytes above which a client that never reads its answers is disconnected."""

PIECE_BYTES = 1 << 16
"""Maximum number of bytes that one call sends; chosen."""

ACCEPTED_AT_ONCE = 4
"""Maximum number of clients that a port accepts in one control cycle."""


class Session(Protocol):
    """One client's session of a protocol. A cycle reads `at_once` bytes, as many as it can answer."""

    at_once: int

    def received(self, data: bytes) -> None:
        """Process data from the client. Raises ProtocolEnd if the connection has to be closed."""
        ...

    def closed(self) -> None:
        """End the session of a client that has disconnected."""
        ...


class ProtocolEnd(Exception):
    """The connection has to be closed after all pending data has been sent."""


class Link:
    """One client's socket: sends as much as possible, queues the rest, and applies faults."""

    def __init__(
        self, link: socket.socket, face: str, faults: FaultInjector, clock: Clock, journal: Journal | None = None
    ) -> None:
        self._journal = journal
        self.socket = link
        self.face = face
        self.ending = False
        self.dead = False
        self._faults = faults
        self._clock = clock
        self._unsent = bytearray()
        self._late: deque[tuple[int, bytes]] = deque()

    def note(self, data: bytes, meaning: Meaning) -> None:
        """Log a frame that the client sent, before it is carried out."""
        if self._journal is not None:
            self._journal.note(self.face, data, meaning)

    def send(self, data: bytes, *, may_drop: bool = False) -> None:
        """Send data as soon as the client accepts it. Data that `may_drop` is lost if too much is already queued."""
        if self.dead or (may_drop and len(self._unsent) > BACKLOG_BYTES):
            return
        if self._faults.quiet and not self._late:
            self._send(data)
            return
        due = self._late[-1][0] if self._late else self._clock.now()
        now = self._clock.now()
        for delay_s, part in self._faults.outgoing(data, self.face):
            # A stream keeps its order, so data behind a delayed message is delayed, too.
            due = max(due, now + round(delay_s * 1e9))
            self._late.append((due, part))
        self.flush()

    def flush(self) -> None:
        """Send queued data that is due."""
        now = self._clock.now() if self._late else 0
        while self._late and self._late[0][0] <= now:
            self._unsent += self._late.popleft()[1]
        while self._unsent:
            # Send in pieces, so that a client that does not read costs one call and no copy of the whole queue.
            sent = self._try(self._unsent[:PIECE_BYTES])
            if not sent:
                break
            del self._unsent[:sent]
        if self.ending and not self._unsent and not self._late:
            self.dead = True

    def _send(self, data: bytes) -> None:
        sent = 0 if self._unsent else self._try(data)
        if sent < len(data):
            self._unsent += data[sent:]
            if len(self._unsent) > LONGEST_BYTES:
                self.dead = True

    def _try(self, data: bytes | bytearray) -> int:
        """Return how many bytes the socket accepted."""
        try:
            return self.socket.send(data)
        except BlockingIOError:
            return 0
        except OSError:
            self.dead = True
            return 0


Open = Callable[[Link], Session]


class Network:
    """All listening sockets and all clients of one controller."""

    def __init__(self, host: str, faults: FaultInjector, clock: Clock, journal: Journal | None = None) -> None:
        self._journal = journal
        self._host = host
        self._faults = faults
        self._clock = clock
        self._poll = select.epoll()
        self._faces: list[tuple[str, int, Open]] = []
        self._listeners: dict[int, tuple[socket.socket, str, Open]] = {}
        self._clients: dict[int, tuple[Link, Session]] = {}
        self._refusing_until_ns = 0
        self._shut = False
        self.acknowledges_at_once = True

    def listen(self, face: str, port: int, open_session: Open) -> None:
        """Serve a protocol on a port. Raises ConnectFailed if the port is in use."""
        self._faces.append((face, port, open_session))
        self._bind(face, port, open_session)

    def poll(self) -> None:
        """Accept connections, read and flush all sockets."""
        self._come_back()
        for descriptor, _events in self._poll.poll(0):
            if descriptor in self._listeners:
                self._accept(descriptor)
            elif descriptor in self._clients:
                self._read(descriptor)
        for descriptor, (link, _) in list(self._clients.items()):
            link.flush()
            if link.dead:
                self._drop(descriptor)

    def end(self, faces: Collection[str]) -> None:
        """Close the connections to some faces once their pending data has been sent."""
        for link, _ in self._clients.values():
            link.ending |= link.face in faces

    def shut(self) -> None:
        """Close all connections and ports for good."""
        self.disconnect(None)
        self._shut = True

    def disconnect(self, for_s: float | None) -> None:
        """Close all connections and refuse new ones for a time, or permanently (None)."""
        self._refusing_until_ns = 2**63 if for_s is None else self._clock.now() + round(for_s * 1e9)
        for descriptor in list(self._clients):
            self._drop(descriptor)
        for descriptor in list(self._listeners):
            self._poll.unregister(descriptor)
            self._listeners.pop(descriptor)[0].close()

    def reconnect(self) -> None:
        """Accept connections again from the next `poll` on."""
        if self._refusing_until_ns:
            self._refusing_until_ns = self._clock.now()

    def close(self) -> None:
        """Close everything."""
        self.disconnect(None)
        if not self._poll.closed:
            self._poll.close()

    # -- inside -------------------------------------------------------------------------------------------

    def _bind(self, face: str, port: int, open_session: Open) -> None:
        listener = socket.socket()
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((self._host, port))
            listener.listen(ACCEPT_QUEUE)
        except OSError as error:
            listener.close()
            problem = f"cannot listen on {self._host}:{port} ({face}): {error.strerror}"
            remedy = "another mock may use it; give each arm its own address: --host 127.0.0.2"
            raise ConnectFailed(
                "mock arm", problem, remedy=remedy if error.errno == errno.EADDRINUSE else ""
            ) from error
        listener.setblocking(False)
        self._listeners[listener.fileno()] = (listener, face, open_session)
        self._poll.register(listener.fileno(), select.EPOLLIN)

    def _come_back(self) -> None:
        if not self._shut and self._refusing_until_ns and self._clock.now() >= self._refusing_until_ns:
            self._refusing_until_ns = 0
            for face, port, open_session in self._faces:
                self._bind(face, port, open_session)

    def _accept(self, descriptor: int) -> None:
        listener, face, open_session = self._listeners[descriptor]
        # A bound, so that clients that connect without end do not stop the control cycle.
        for _ in range(ACCEPTED_AT_ONCE):
            try:
                link, _address = listener.accept()
            except OSError:
                return
            if self._faults.strikes("busy", face):
                link.close()
                continue
            link.setblocking(False)
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            client = Link(link, face, self._faults, self._clock, self._journal)
            self._clients[link.fileno()] = (client, open_session(client))
            self._poll.register(link.fileno(), select.EPOLLIN)

    def _read(self, descriptor: int) -> None:
        link, session = self._clients[descriptor]
        try:
            data = link.socket.recv(session.at_once)
            if self.acknowledges_at_once and not self._faults.strikes("delayed-ack", link.face):
                # Without this, clients without TCP_NODELAY send their second package 40 ms late.
                link.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._drop(descriptor)
            return
        if link.ending:
            return
        try:
            session.received(data)
        except ProtocolEnd:
            link.ending = True

    def _drop(self, descriptor: int) -> None:
        link, session = self._clients.pop(descriptor)
        session.closed()
        with contextlib.suppress(OSError, ValueError):
            self._poll.unregister(descriptor)
        link.dead = True
        link.socket.close()
