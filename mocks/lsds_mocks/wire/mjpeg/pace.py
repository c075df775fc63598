"""Flow control per client: no new picture while the client has not read the last one.

TCP does not inform a sender of what its peer has read; the advertised window also changes for other reasons. The peer
of a loopback connection, however, is in the same kernel, which reports the unread bytes of any socket (sock_diag(7), as
used by `ss`).
"""

from __future__ import annotations

import fcntl
import socket
import struct
import termios

SEND_BUFFER = 1024 * 1024
"""Send buffer (bytes), enough for one whole picture. A smaller buffer would not avoid old pictures, since `Pace` sends
none while the last one is in the buffer. It would only make a large picture wait for acknowledgements, which arrive
late on loopback."""

_NETLINK_SOCK_DIAG = 4
"""Netlink protocol that reports on sockets (linux/netlink.h)."""
_SOCK_DIAG_BY_FAMILY = 20
"""Type of a netlink message about the sockets of an address family (linux/sock_diag.h)."""
_NLM_F_REQUEST = 1
"""Flag of a netlink message that requests something (linux/netlink.h)."""
_ESTABLISHED = 1 << 1
"""Set of socket states that a query selects, one bit each: established TCP connections, state 1."""
_HEADER = struct.Struct("=IHHII")
_REQUEST = struct.Struct("=BBBBI")
_ANSWER_RQUEUE = _HEADER.size + 4 + 48 + 4
"""Offset of the unread bytes: after the netlink header come four bytes (family, state, timer, retransmits), the
socket's id and its expiry."""


class Pace:
    """Decides for each picture whether to send it to a client; always sends if the kernel gives no information."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._query = _query(connection)
        try:
            self._diag: socket.socket | None = socket.socket(
                getattr(socket, "AF_NETLINK", -1), socket.SOCK_DGRAM, _NETLINK_SOCK_DIAG
            )
            self._diag.settimeout(0.1)
        except OSError:
            self._diag = None
        self._last_size = 0

    def ready(self) -> bool:
        """Return whether the client has read at least half of the last picture."""
        return self._unsent() == 0 and 2 * self.unread() <= self._last_size

    def sent(self, size: int) -> None:
        """Record that a picture of `size` bytes was sent."""
        self._last_size = size

    def unread(self) -> int:
        """Return the number of unread bytes in the client's socket; 0 if it is unknown."""
        if self._diag is None:
            return 0
        try:
            self._diag.sendto(self._query, (0, 0))
            answer = self._diag.recv(4096)
        except OSError:
            return 0
        if len(answer) < _ANSWER_RQUEUE + 4 or _HEADER.unpack_from(answer)[1] != _SOCK_DIAG_BY_FAMILY:
            return 0
        return int(struct.unpack_from("=I", answer, _ANSWER_RQUEUE)[0])

    def close(self) -> None:
        """Close the netlink socket."""
        if self._diag is not None:
            self._diag.close()

    def _unsent(self) -> int:
        return int(struct.unpack("i", fcntl.ioctl(self._connection, termios.TIOCOUTQ, b"\0" * 4))[0])


def _query(connection: socket.socket) -> bytes:
    """Return the netlink request about the other end of a connection."""
    ours, theirs = connection.getsockname(), connection.getpeername()
    family = connection.family

    def address(name: tuple[str, int]) -> bytes:
        return socket.inet_pton(family, name[0]).ljust(16, b"\0")

    identity = struct.pack("!HH", theirs[1], ours[1]) + address(theirs) + address(ours)
    identity += struct.pack("=I", 0) + b"\xff" * 8  # any interface, any cookie
    body = _REQUEST.pack(family, socket.IPPROTO_TCP, 0, 0, _ESTABLISHED) + identity
    return _HEADER.pack(_HEADER.size + len(body), _SOCK_DIAG_BY_FAMILY, _NLM_F_REQUEST, 0, 0) + body
