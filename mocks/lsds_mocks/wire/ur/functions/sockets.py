"""Script functions for TCP connections. None of them blocks a control cycle."""

from __future__ import annotations

import errno
import socket
import struct
from typing import TYPE_CHECKING, Any

from lsds_mocks.wire.address import on_loopback
from lsds_mocks.wire.ur.controller import CYCLE_S
from lsds_mocks.wire.ur.messages import TextMessage
from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.script.operations import MOST_ELEMENTS
from lsds_mocks.wire.ur.script.program import Waiting
from lsds_mocks.wire.ur.script.values import UrList

if TYPE_CHECKING:
    from lsds_mocks.wire.ur.controller import Controller

SOCKET_CONNECT_S = 2.0
"""Time limit for opening a socket (s)."""
SOCKET_ANSWER_S = 2.0
"""Time limit for reading a line from a socket (s)."""
DEFAULT = "socket_0"
MOST_OPEN = 16
"""Maximum number of open sockets per program."""

READS_PER_CYCLE = 8
"""Maximum number of reads per cycle; further reads wait for the next cycle."""

KEPT_BYTES = 1 << 18
"""Maximum number of received bytes that a program has not read; further bytes wait at the sender."""


class _Connection:
    """One open socket with its received bytes that the program has not read."""

    def __init__(self, link: socket.socket) -> None:
        self.link = link
        self.data = bytearray()
        self.ended = False

    def pull(self) -> None:
        try:
            while len(self.data) < KEPT_BYTES:
                part = self.link.recv(65536)
                if not part:
                    self.ended = True
                    return
                self.data += part
        except BlockingIOError:
            pass
        except OSError:
            self.ended = True


class Functions:
    """Bound to one controller and to the ports that a program may open."""

    def __init__(self, controller: Controller, ports: frozenset[int] = frozenset()) -> None:
        self._c = controller
        self._ports = ports
        self._explained = False
        self._open: dict[str, _Connection] = {}

    def socket_open(self, address: str, port: int, socket_name: str = DEFAULT) -> Waiting:
        """Connect; return whether that succeeded. Only this machine's addresses and allowed ports are tried."""
        self.socket_close(socket_name)
        if ":" in address or not on_loopback(address):
            return False
        if len(self._open) >= MOST_OPEN:
            raise ScriptError(f"socket_open: more than {MOST_OPEN} sockets")
        # Open at most one socket per cycle, however quickly the peer accepts.
        yield
        if int(port) not in self._ports:
            self._explain(int(port))
            return False
        link = socket.socket()
        try:
            link.setblocking(False)
            outcome = link.connect_ex((address, int(port)))
            for _ in range(round(SOCKET_CONNECT_S / CYCLE_S)):
                if outcome not in (errno.EINPROGRESS, errno.EALREADY):
                    break
                yield
                outcome = link.connect_ex((address, int(port)))
        except BaseException:
            # The program has been stopped, or the port number is invalid.
            link.close()
            raise
        if outcome not in (0, errno.EISCONN):
            link.close()
            return False
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._open[socket_name] = _Connection(link)
        return True

    def close_all(self) -> None:
        """Close all sockets at the end of the program."""
        for name in list(self._open):
            self.socket_close(name)

    def socket_close(self, socket_name: str = DEFAULT) -> None:
        """Close."""
        connection = self._open.pop(socket_name, None)
        if connection is not None:
            connection.link.close()

    def socket_send_int(self, value: Any, socket_name: str = DEFAULT) -> bool:
        """Send 32 bits, network order."""
        return self._send(struct.pack(">i", (int(value) + 2**31) % 2**32 - 2**31), socket_name)

    def socket_send_byte(self, value: Any, socket_name: str = DEFAULT) -> bool:
        """Send a byte."""
        return self._send(bytes([int(value) & 0xFF]), socket_name)

    def socket_send_string(self, text: Any, socket_name: str = DEFAULT) -> bool:
        """Send a text as it is."""
        return self._send(self._c.operations.text(text).encode(), socket_name)

    def socket_send_line(self, text: Any, socket_name: str = DEFAULT) -> bool:
        """Send a text and a line feed."""
        return self._send(self._c.operations.text(text).encode() + b"\n", socket_name)

    def socket_set_var(self, name: Any, value: Any, socket_name: str = DEFAULT) -> bool:
        """Send "SET <name> <value>" and a line feed; the program reads the answer like any other text."""
        text = self._c.operations.text
        return self._send(f"SET {text(name)} {int(value)}\n".encode(), socket_name)

    def socket_get_var(self, name: Any, socket_name: str = DEFAULT) -> Waiting:
        """Send "GET <name>" and a line feed; return the number in the answer "<name> <number>", 0 without an answer."""
        name = self._c.operations.text(name)
        self._send(f"GET {name}\n".encode(), socket_name)
        data = yield from self._wait(socket_name, SOCKET_ANSWER_S, lambda buffer: buffer.find(b"\n") + 1)
        words = [] if data is None else data.decode("utf-8", "replace").split()
        if len(words) != 2 or words[0] != name:
            return 0
        try:
            return self._c.operations.checked(int(words[1]))
        except ValueError:
            return 0

    def socket_read_binary_integer(self, number: int, socket_name: str = DEFAULT, timeout: float = 2.0) -> Waiting:
        """Read 32-bit numbers; the list begins with their count, 0 on timeout (a timeout of 0 waits indefinitely)."""
        count = self._count(number)
        size = 4 * count
        data = yield from self._wait(socket_name, timeout, lambda buffer: size if len(buffer) >= size else 0)
        if data is None:
            return UrList([0] + [0] * count)
        return UrList([count, *struct.unpack(f">{count}i", data)])

    def socket_read_byte_list(self, number: int, socket_name: str = DEFAULT, timeout: float = 2.0) -> Waiting:
        """Read bytes; the list begins with their count."""
        size = self._count(number)
        data = yield from self._wait(socket_name, timeout, lambda buffer: size if len(buffer) >= size else 0)
        return UrList([0]) if data is None else UrList([size, *data])

    def socket_read_ascii_float(self, number: int, socket_name: str = DEFAULT, timeout: float = 2.0) -> Waiting:
        """Read numbers in brackets, "(1.4, 3)"; the list begins with their count."""
        data = yield from self._wait(socket_name, timeout, lambda buffer: buffer.find(b")") + 1)
        if data is None:
            return UrList([0])
        text = data.decode("ascii", "replace").strip().strip("()")
        try:
            values = [float(part) for part in text.split(",")][: self._count(number)]
        except ValueError:
            return UrList([0])
        return UrList([len(values), *values])

    def socket_read_line(self, socket_name: str = DEFAULT, timeout: float = 2.0) -> Waiting:
        """Read up to a line feed; an empty string on timeout."""
        data = yield from self._wait(socket_name, timeout, lambda buffer: buffer.find(b"\n") + 1)
        return self._text(data).rstrip("\r\n")

    def socket_read_string(
        self,
        socket_name: str = DEFAULT,
        prefix: str = "",
        suffix: str = "",
        interpret_escape: bool = False,
        timeout: float = 2.0,
    ) -> Waiting:
        """Read the received text, or the part between a prefix and a suffix if they are given."""
        end = suffix.encode()
        data = (
            yield from self._wait(
                socket_name, timeout, lambda buffer: (buffer.find(end) + len(end)) if end in buffer else 0
            )
            if end
            else self._wait(socket_name, timeout, lambda buffer: min(len(buffer), MOST_ELEMENTS))
        )
        text = self._text(data)
        return text.removesuffix(suffix).removeprefix(prefix)

    # -- inside -------------------------------------------------------------------------------------------

    def _explain(self, port: int) -> None:
        """Report the first port that is not allowed."""
        if not self._explained:
            self._explained = True
            remedy = f"start the mock with --socket-ports '[{port}]'"
            rule = "by default only ports are allowed on which the sender of the program listens"
            self._c.post_message(TextMessage(f"socket_open: port {port} is not allowed; {rule}; {remedy}"))

    def _count(self, number: Any) -> int:
        if not 0 < int(number) <= MOST_ELEMENTS:
            raise ScriptError(f"type_error: {int(number)} numbers cannot be read, but 1 to {MOST_ELEMENTS}")
        self._c.work.spend(4 * int(number))
        return int(number)

    def _text(self, data: bytes | None) -> str:
        text = "" if data is None else data.decode("utf-8", "replace")
        return str(self._c.operations.checked(text))

    def _send(self, data: bytes, name: str) -> bool:
        connection = self._open.get(name)
        if connection is None:
            return False
        try:
            return connection.link.send(data) == len(data)
        except OSError:
            return False

    def _wait(self, name: str, timeout: float, enough: Any) -> Waiting:
        cycles = round(timeout / CYCLE_S) if timeout > 0 else None
        waited = 0
        while self._c.reads >= READS_PER_CYCLE:
            yield
        self._c.reads += 1
        while True:
            connection = self._open.get(name)
            if connection is not None:
                connection.pull()
                size = enough(connection.data)
                if size:
                    data = bytes(connection.data[:size])
                    del connection.data[:size]
                    return data
            # A disconnected peer sends nothing more; return that, but at most once per cycle.
            hung_up = connection is None or connection.ended
            if waited and (hung_up or (cycles is not None and waited >= cycles)):
                return None
            waited += 1
            yield
