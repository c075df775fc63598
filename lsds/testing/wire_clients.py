"""Clients of wire mocks that know no protocol: they connect, send bytes and leave."""

from __future__ import annotations

import contextlib
import os
import random
import re
import socket
import stat
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from lsds.clock import WallClock, nanoseconds

CONNECTED_S = 2.0
"""Time within which a face has to accept a client."""
_TCP = re.compile(r"(?:[a-z]+://)?\[?(?P<host>[^\]/]+?)\]?:(?P<port>\d+)(?:/.*)?")
_TABLES = (Path("/proc/net/tcp"), Path("/proc/net/tcp6"))


@dataclass(frozen=True, slots=True)
class Endpoint:
    """Location of a face: `host` and `port` of TCP, else the `path` of a socket, a terminal or a pipe."""

    host: str = ""
    port: int = 0
    path: str = ""


def endpoint_of(address: str) -> Endpoint | None:
    """Return the endpoint of an address, None for a text that is not an address."""
    if os.path.exists(address):
        return Endpoint(path=address)
    if (match := _TCP.fullmatch(address)) and 0 < int(match["port"]) < 65536:
        return Endpoint(match["host"], int(match["port"]))
    return None


@contextmanager
def client_of(endpoint: Endpoint) -> Iterator[socket.socket | int]:
    """Yield a connection: a socket, or the descriptor of a file. Raises OSError."""
    if endpoint.port:
        with socket.create_connection((endpoint.host, endpoint.port), CONNECTED_S) as link:
            yield link
    elif stat.S_ISSOCK(os.stat(endpoint.path).st_mode):
        with _unix(endpoint.path) as link:
            yield link
    else:
        reads = os.O_RDONLY if stat.S_ISFIFO(os.stat(endpoint.path).st_mode) else os.O_RDWR
        number = os.open(endpoint.path, reads | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            yield number
        finally:
            os.close(number)


def is_accepted(endpoint: Endpoint, link: socket.socket | int) -> bool:
    """Return whether the server has accepted a connection, within `CONNECTED_S`; True where that cannot be known."""
    if not endpoint.port or not isinstance(link, socket.socket) or not _TABLES[0].exists():
        return True
    wall, port = WallClock(), link.getsockname()[1]
    deadline = wall.now() + nanoseconds(CONNECTED_S)
    while not _has_owner(endpoint.port, port):
        if wall.now() > deadline:
            return False
        wall.sleep_until(wall.now() + nanoseconds(0.01))
    return True


def send_garbage(link: socket.socket | int, seed: int) -> None:
    """Send bytes of no protocol, including a line without end. Ignores a closed connection."""
    drawn = random.Random(seed)
    for message in (drawn.randbytes(300), b"\xff" * 64, b"\0" * 64, b"GET / \xc3(", b"{[(" * 2000, b"\r\n"):
        with contextlib.suppress(OSError):
            if isinstance(link, socket.socket):
                link.send(message)
            else:
                os.write(link, message)


def reset_on_close(link: socket.socket | int) -> None:
    """Let closing a TCP connection reset it."""
    if isinstance(link, socket.socket) and link.family in (socket.AF_INET, socket.AF_INET6):
        link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))


def _unix(path: str) -> socket.socket:
    """Return a connection to a socket in the file system, of the type that it has."""
    for kind in (socket.SOCK_STREAM, socket.SOCK_SEQPACKET):
        link = socket.socket(socket.AF_UNIX, kind)
        link.settimeout(CONNECTED_S)
        try:
            link.connect(path)
        except OSError:
            link.close()
            if kind is socket.SOCK_SEQPACKET:
                raise
            continue
        return link
    raise AssertionError("unreachable")


def _has_owner(server: int, client: int) -> bool:
    """Return whether the server's end of a TCP connection belongs to a process: until it is accepted, it does not."""
    for table in _TABLES:
        with contextlib.suppress(OSError):
            for row in table.read_text().splitlines()[1:]:
                part = row.split()
                ports = [int(part[i].rpartition(":")[2], 16) for i in (1, 2)]
                if ports == [server, client] and part[9] != "0":
                    return True
    return False
