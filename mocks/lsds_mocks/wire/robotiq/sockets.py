"""A TCP face: a listener and its clients, each with a separate session."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Protocol

from lsds.errors import ConnectFailed
from lsds_mocks.wire.address import ACCEPT_QUEUE

if TYPE_CHECKING:
    from lsds_mocks.wire.robotiq.reactor import Reactor


class Conversation(Protocol):
    """The state of a face for one client."""

    def receive(self, data: bytes) -> None:
        """Receive bytes from the client."""
        ...

    def hang_up(self) -> None:
        """End the session of a client that has disconnected."""
        ...


class TcpFace:
    """Listens on one port. It accepts a client beyond `most` and disconnects it at once, as a port in use does."""

    def __init__(
        self,
        name: str,
        mock: str,
        address: tuple[str, int],
        most: int,
        reactor: Reactor,
        make: Callable[[Callable[[bytes], None]], Conversation],
    ) -> None:
        self.name = name
        self._mock = mock
        self._address = address
        self._most = most
        self._reactor = reactor
        self._make = make
        self._taken = False
        self._listener: socket.socket | None = None
        self._clients: dict[socket.socket, Conversation] = {}

    @property
    def address(self) -> str:
        """Host and port."""
        host, port = self._address
        return f"{host}:{port}"

    @property
    def up(self) -> bool:
        """Whether it listens."""
        return self._listener is not None

    def open(self) -> None:
        """Listen; after a `drop`, on the same port. Raises ConnectFailed if the port is in use."""
        host, port = self._address
        listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind((host, port))
            listener.listen(ACCEPT_QUEUE)
        except OSError as error:
            listener.close()
            raise ConnectFailed(
                self._mock,
                f"cannot listen on {self.address} ({self.name}): {error.strerror or error}",
                remedy="another mock may run; choose another port, or 0 for a free one",
            ) from error
        listener.setblocking(False)
        self._address = (host, listener.getsockname()[1])
        self._listener = listener
        self._reactor.watch(listener.fileno(), self._accept)

    def drop(self) -> None:
        """Disconnect all clients and stop listening."""
        for client in list(self._clients):
            self._hang_up(client)
        if self._listener is not None:
            self._reactor.unwatch(self._listener.fileno())
            self._listener.close()
            self._listener = None

    def hold(self, taken: bool) -> None:
        """Act as a port in use by another client (True), or accept the next client (False)."""
        if taken:
            for client in list(self._clients):
                self._hang_up(client)
        self._taken = taken

    def close(self) -> None:
        """Release all resources."""
        self.drop()

    def _accept(self) -> None:
        assert self._listener is not None
        try:
            client, _ = self._listener.accept()
        except OSError:
            return
        if self._taken or len(self._clients) >= self._most:
            client.close()
            return
        client.setblocking(False)
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._clients[client] = self._make(partial(self._send, client))
        self._reactor.watch(client.fileno(), partial(self._readable, client))

    def _readable(self, client: socket.socket) -> None:
        try:
            data = client.recv(4096)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if data:
            self._clients[client].receive(data)
        else:
            self._hang_up(client)

    def _send(self, client: socket.socket, data: bytes) -> None:
        # Data for a client that has vanished or does not read is lost.
        with contextlib.suppress(OSError):
            client.send(data)

    def _hang_up(self, client: socket.socket) -> None:
        self._clients.pop(client).hang_up()
        self._reactor.unwatch(client.fileno())
        client.close()
