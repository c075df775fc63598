"""An MJPEG server on loopback: HTTP/1.0, `multipart/x-mixed-replace`, newest picture only, any number of readers."""

from __future__ import annotations

import select
import socket
import threading
from contextlib import closing, suppress
from typing import TYPE_CHECKING

from lsds.clock import NS_PER_S, WallClock, nanoseconds
from lsds.errors import ConnectFailed
from lsds_mocks.wire.address import ACCEPT_QUEUE, is_loopback
from lsds_mocks.wire.mjpeg.newest import Newest, Picture
from lsds_mocks.wire.mjpeg.pace import SEND_BUFFER, Pace
from lsds_mocks.wire.mjpeg.request import Wish, read_request

if TYPE_CHECKING:
    from lsds_mocks.wire.faults import FaultInjector
    from lsds_mocks.wire.journal import Journal

BOUNDARY = "boundarydonotcross"
MOST_CLIENTS = 16
"""Maximum number of clients that read pictures at the same time."""
MOST_SILENT = 64
"""Maximum number of clients that have not sent their request yet. One more replaces the oldest of them, so that clients
that send nothing do not keep out those that do."""
_NEVER_NS = 2**63
"""End of a refusal of connections without a time limit, ns: later than any clock value."""
_SEND_TIMEOUT_S = 10.0
"""Time limit for sending to a client, and for the picture of a snapshot, s; chosen."""
_SERVER_POLL_S = 0.2
"""Longest wait before a thread of the server checks whether it has to end, s; chosen."""
_COMMON = "Connection: close\r\nServer: lsds-mock\r\nCache-Control: no-store, no-cache\r\nPragma: no-cache\r\n"
_STATUS: dict[Wish, str] = {
    "bad-request": "400 Bad Request",
    "bad-method": "405 Method Not Allowed",
    "not-found": "404 Not Found",
}


def part(picture: Picture) -> bytes:
    """Return one part of the stream with the boundary after it, so that a reader detects the part's end at once."""
    head = (
        f"Content-Type: image/jpeg\r\nContent-Length: {len(picture.jpeg)}\r\n"
        f"X-Timestamp: {picture.t_ns / NS_PER_S:.6f}\r\nX-Sequence: {picture.seq}\r\n\r\n"
    )
    return head.encode() + picture.jpeg + f"\r\n--{BOUNDARY}\r\n".encode()


class MjpegServer:
    """Serves the pictures given to `publish`. One thread accepts, one serves each client."""

    def __init__(
        self, name: str, host: str, port: int, faults: FaultInjector, face: str = "http", journal: Journal | None = None
    ) -> None:
        self._name = name
        self._wanted = (host, port)
        self._faults = faults
        self._face = face
        self._journal = journal
        self._clock = WallClock()
        self._newest = Newest()
        self._listener: socket.socket | None = None
        self._lock = threading.Lock()
        self._clients: dict[socket.socket, Wish | None] = {}
        self._threads: set[threading.Thread] = set()
        self._refusing_until_ns = 0
        self._closed = False

    def start(self) -> tuple[str, int]:
        """Listen; return the bound host and port. Raises ConnectFailed."""
        host, port = self._wanted
        if not is_loopback(host):
            raise ConnectFailed(self._name, f"'{host}' is not loopback", remedy="a mock listens on 127.0.0.1 only")
        try:
            listener = socket.create_server((host, port), backlog=ACCEPT_QUEUE)
        except OSError as error:
            raise ConnectFailed(
                self._name, f"cannot listen on {host}:{port}: {error.strerror}", remedy="--port 0 takes a free one"
            ) from error
        # An accepted connection inherits the buffer size of its listener, so set it here.
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)
        listener.settimeout(_SERVER_POLL_S)
        self._listener = listener
        self._start_thread(self._accept, listener)
        bound = listener.getsockname()
        return str(bound[0]), int(bound[1])

    @property
    def watched(self) -> bool:
        """True if any client needs pictures now."""
        with self._lock:
            return any(wish in ("stream", "snapshot") for wish in self._clients.values())

    @property
    def streaming(self) -> bool:
        """True if any client reads the stream now."""
        with self._lock:
            return "stream" in self._clients.values()

    def publish(self, picture: Picture) -> None:
        """Set the newest picture, without waiting for readers."""
        if not self.strike():
            self._newest.put(picture)

    def strike(self) -> bool:
        """Disconnect all clients if that fault is due, and refuse new ones while it lasts; return whether it is due."""
        cut = self._faults.strikes("disconnect", self._face)
        if cut is None:
            return False
        left_s = self._faults.remaining_s(cut)
        if left_s is None and cut.count is None and cut.chance >= 1:
            self._refusing_until_ns = _NEVER_NS
        else:
            self._refusing_until_ns = self._clock.now() + nanoseconds(left_s or 0.0)
        self._cut()
        return True

    def reconnect(self) -> None:
        """Accept clients again; a disconnect that is still on strikes at the next exposure."""
        self._refusing_until_ns = 0

    def close(self) -> None:
        """Close the listener and all clients, and wait for their threads."""
        self._closed = True
        self._newest.close()
        if self._listener is not None:
            self._listener.close()
        self._cut()
        with self._lock:
            threads = list(self._threads)
        for thread in threads:
            thread.join(_SERVER_POLL_S * 5)

    # -- inside -------------------------------------------------------------------------------------------

    def _start_thread(self, target: object, *arguments: object) -> None:
        def run() -> None:
            try:
                target(*arguments)  # type: ignore[operator]
            finally:
                with self._lock:
                    self._threads.discard(threading.current_thread())

        thread = threading.Thread(target=run, name=f"{self._name}-{self._face}", daemon=True)
        # Start under the lock, because `close` cannot join a thread that has not started.
        with self._lock:
            self._threads.add(thread)
            thread.start()

    def _accept(self, listener: socket.socket) -> None:
        while not self._closed:
            try:
                connection, _ = listener.accept()
            except TimeoutError:
                continue
            except OSError:
                if self._closed:
                    return
                continue
            with self._lock:
                silent = [client for client, wanted in self._clients.items() if wanted is None]
                if len(silent) >= MOST_SILENT:
                    # Its thread reads the end of the connection and releases it.
                    with suppress(OSError):
                        silent[0].shutdown(socket.SHUT_RDWR)
                self._clients[connection] = None
            if self._closed or self._clock.now() < self._refusing_until_ns:
                self._drop(connection)
            else:
                self._start_thread(self._serve, connection)

    def _serve(self, connection: socket.socket) -> None:
        # An error or disconnection of a client ends only that client's thread.
        try:
            with suppress(OSError):
                wanted = read_request(connection, self._note)
                connection.settimeout(_SEND_TIMEOUT_S)
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                with self._lock:
                    if sum(wish is not None for wish in self._clients.values()) >= MOST_CLIENTS:
                        return
                    if connection in self._clients:
                        self._clients[connection] = wanted
                if wanted == "stream":
                    self._stream(connection)
                elif wanted == "snapshot":
                    self._snapshot(connection)
                elif wanted in _STATUS:
                    connection.sendall(f"HTTP/1.0 {_STATUS[wanted]}\r\n{_COMMON}Content-Length: 0\r\n\r\n".encode())
        finally:
            self._drop(connection)

    def _note(self, request: bytes) -> None:
        if self._journal is not None:
            self._journal.note(self._face, request, request.partition(b"\n")[0].decode("latin-1").strip())

    def _stream(self, connection: socket.socket) -> None:
        kind = f"Content-Type: multipart/x-mixed-replace;boundary={BOUNDARY}"
        connection.sendall(f"HTTP/1.0 200 OK\r\n{_COMMON}{kind}\r\n\r\n--{BOUNDARY}\r\n".encode())
        with closing(Pace(connection)) as pace:
            number = self._newest.number
            while not self._closed:
                found = self._newest.after(number, _SERVER_POLL_S)
                if _gone(connection):
                    return
                if found is None:
                    continue
                number, picture = found
                if pace.ready():
                    pace.sent(self._send(connection, picture))

    def _send(self, connection: socket.socket, picture: Picture) -> int:
        """Send one part with its faults; return the number of bytes sent."""
        size = 0
        for delay_s, message in self._faults.outgoing(part(picture), self._face):
            if delay_s > 0:
                self._clock.sleep_until(self._clock.now() + nanoseconds(delay_s))
            connection.sendall(message)
            size += len(message)
        return size

    def _snapshot(self, connection: socket.socket) -> None:
        found = self._newest.after(self._newest.number, _SEND_TIMEOUT_S)
        if found is None:
            connection.sendall(f"HTTP/1.0 503 Service Unavailable\r\n{_COMMON}Content-Length: 0\r\n\r\n".encode())
            return
        jpeg = found[1].jpeg
        head = f"HTTP/1.0 200 OK\r\n{_COMMON}Content-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
        connection.sendall(head.encode() + jpeg)

    def _cut(self) -> None:
        with self._lock:
            connections = list(self._clients)
        for connection in connections:
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)

    def _drop(self, connection: socket.socket) -> None:
        with self._lock:
            self._clients.pop(connection, None)
        connection.close()


def _gone(connection: socket.socket) -> bool:
    """Return whether the client has disconnected, which would go unnoticed while nothing is sent to it."""
    poll = select.poll()
    poll.register(connection, select.POLLIN | select.POLLRDHUP)
    return bool(poll.poll(0)) and connection.recv(4096) == b""
