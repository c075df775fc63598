"""The gripper's registers over Modbus RTU, by pymodbus: on a serial port, or RTU frames over TCP."""

from __future__ import annotations

import logging
import math
import select
import socket
import time
from collections import deque
from typing import TYPE_CHECKING, Any

from lsds.errors import ConnectFailed, DeviceTimeout, ProtocolFault
from lsds_drivers.robotiq.options import tcp_address
from lsds_drivers.robotiq.patience import Patience
from lsds_drivers.robotiq.registers import COMMAND_REGISTER, STATUS_REGISTER, Motion, Status, command_words
from lsds_drivers.robotiq.serial_port import open_serial

if TYPE_CHECKING:
    from pymodbus.client import ModbusSerialClient, ModbusTcpClient

_HOLDING = 3
"""Modbus function code: read holding registers."""
_INPUT = 4
"""Modbus function code: read input registers."""
_WRITE = 16
"""Modbus function code: write multiple registers."""
_ASKS = tuple((function, count) for count in range(3, 9) for function in (_INPUT, _HOLDING))
"""Status requests (function, number of registers), which differ in their answers; the first three registers have a
meaning."""
_PLAIN = 2
"""Number of requests for three registers; the others follow losses, if the gripper answers them."""
_LEAST_MODBUS_WAIT_S = 0.015
"""Minimum wait for an answer (s); chosen."""
QUIET_S = 0.02
"""Silence after which no late answer can arrive (s); a USB adapter may delay an answer by 16 ms."""


_EXCEPTION = 0x80
"""Modbus: bit of the function code that marks an exception."""
QUICK_FACTOR = 2.0
"""Factor on the fastest answer time up to which an answer is quick; chosen."""
QUICK_ANSWERS = 3
"""Number of quick answers in a row after which answers belong to the newest requests; chosen."""
LATEST_ANSWER_S = 1.0
"""Time after its request at which an answer cannot arrive any more (s); chosen."""


class ModbusTransport:
    """A `Transport` on a serial port or, for tcp://host:port, on a socket that carries the same frames.

    RTU answers do not identify their request. To avoid assigning a late answer to a later request, an unanswered
    request is not repeated within `timeout_s`; instead, the status is requested with another function or length, whose
    answer differs. After a damaged answer, and before a write that follows a lost one, the line must be silent.

    A lost frame costs twice the usual answer time (`Patience`), not `timeout_s`.
    """

    def __init__(self, device: str, port: str, slave: int, baud: int, timeout_s: float) -> None:
        self._device = device
        self._port = port
        self._slave = slave
        self._baud = baud
        self._timeout_s = timeout_s
        self._client: ModbusSerialClient | ModbusTcpClient | None = None
        self._patience = Patience(_LEAST_MODBUS_WAIT_S, timeout_s)
        self._heard = self._answered = False
        self._unsettled = False
        self._unanswered: dict[tuple[int, int], float] = {}
        self._open: deque[tuple[tuple[int, int], float]] = deque()
        self._asked_s, self._fastest_s, self._quick = 0.0, timeout_s, 0
        self._untried = list(_ASKS[_PLAIN : _PLAIN + 2])
        self._ways: tuple[tuple[int, int], ...] = _ASKS[:_PLAIN]

    @property
    def is_open(self) -> bool:
        """Whether requests can be made."""
        return self._client is not None and self._client.socket is not None

    @property
    def waited_s(self) -> float:
        """Time (s) since the earliest request that the last answer may belong to: answers arrive in order."""
        return time.monotonic() - self._asked_s

    def open(self, timeout_s: float) -> None:
        """Open port or socket. Raises ConnectFailed with a remedy."""
        from pymodbus import FramerType
        from pymodbus.client import ModbusSerialClient, ModbusTcpClient

        self.close()
        # Answers to requests of the former connection do not arrive on this one.
        self._open.clear()
        # pymodbus logs a warning for every damaged answer; here they are counted and reported with the error. They
        # still appear if logging is configured.
        logging.getLogger("pymodbus").addHandler(logging.NullHandler())
        address = tcp_address(self._port)
        client: ModbusSerialClient | ModbusTcpClient
        if address is None:
            port = open_serial(self._device, self._port, self._baud, self._timeout_s)
            client = ModbusSerialClient(
                self._port, baudrate=self._baud, timeout=self._timeout_s, retries=0, trace_packet=self._trace
            )
            client.socket = port
        else:
            connection = open_socket(self._device, address, timeout_s)
            client = ModbusTcpClient(
                address[0],
                port=address[1],
                framer=FramerType.RTU,
                timeout=self._timeout_s,
                retries=0,
                trace_packet=self._trace,
            )
            client.socket = connection
        self._client = client

    def close(self) -> None:
        """Close port or socket."""
        client: Any
        client, self._client = self._client, None
        if client is not None:
            client.close()

    def read(self) -> Status:
        """Request the three status registers."""
        function, count = way = self._way()
        client = self._ready()
        ask = client.read_holding_registers if function == _HOLDING else client.read_input_registers
        answer = self._exchange(way, ask, STATUS_REGISTER, count=count)
        came = len(answer.registers) if answer.function_code == function else 0
        # Also accept three registers in answer to any request, unless that could be a late answer.
        if came != count and (came != _ASKS[0][1] or self._is_unanswered((function, came))):
            self._patience.late()
            raise self._spoilt("an answer that belongs to another request")
        if came != count:
            self._untried.clear()
        elif count > _ASKS[0][1]:
            self._ways = _ASKS
            self._untried.clear()
        return Status.from_registers(answer.registers)

    def write(self, action: int, motion: Motion | None) -> None:
        """Write one command register, or all three."""
        words = command_words(action, motion)
        way = (_WRITE, len(words))
        self._unsettled = self._unsettled or self._is_unanswered(way)
        answer = self._exchange(way, self._ready().write_registers, COMMAND_REGISTER, words)
        if answer.function_code != _WRITE or (answer.address, answer.count) != (COMMAND_REGISTER, len(words)):
            self._patience.late()
            raise self._spoilt("an answer that belongs to another request")

    # -- inside -------------------------------------------------------------------------------------------

    def _ready(self) -> Any:
        client = self._client
        # Without this socket pymodbus would open another one.
        if client is None or client.socket is None:
            raise self._lost()
        return client

    def _way(self) -> tuple[int, int]:
        """Return the first status request whose answer cannot be mistaken for that of an earlier request."""
        if self._untried and self._answered:
            return self._untried.pop(0)
        for way in self._ways:
            if not self._is_unanswered(way):
                return way
        self._unsettled = True
        return min(self._ways, key=lambda way: self._unanswered[way])

    def _is_unanswered(self, way: tuple[int, int]) -> bool:
        return time.monotonic() - self._unanswered.get(way, -math.inf) < self._timeout_s + QUIET_S

    def _exchange(self, way: tuple[int, int], ask: Any, *arguments: Any, **keywords: Any) -> Any:
        from pymodbus.exceptions import ConnectionException, ModbusException, ModbusIOException

        self._heard = False
        wait_s = self._patience.wait_s
        try:
            self._drain()
            began = time.monotonic()
            self._unanswered[way] = began
            while self._open and began - self._open[0][1] > LATEST_ANSWER_S:
                self._open.popleft()
            self._open.append((way, began))
            wait_s = self._wait(wait_s)
            answer = ask(*arguments, device_id=self._slave, **keywords)
        except ModbusIOException as error:
            self._patience.silent()
            if self._heard:
                raise self._spoilt("a damaged answer") from error
            raise DeviceTimeout(
                self._device,
                f"no answer on {self._port} within {1e3 * wait_s:.0f} ms",
                remedy=f"check the gripper's 24 V, its cable, and that it is slave {self._slave}",
            ) from error
        except (ConnectionException, OSError) as error:
            self.close()
            raise self._lost() from error
        except (ModbusException, ArithmeticError, LookupError, TypeError, ValueError) as error:
            raise self._spoilt(f"an answer that cannot be decoded ({error})") from error
        if answer.function_code & ~_EXCEPTION == way[0]:
            self._attribute(way, began)
        if answer.isError():
            raise self._spoilt("a Modbus exception, which this gripper does not know")
        if answer.function_code == way[0]:
            self._patience.answered(time.monotonic() - began)
            self._unanswered.pop(way, None)
            self._answered = True
        return answer

    def _attribute(self, way: tuple[int, int], began_s: float) -> None:
        """Note the time of the request that an answer belongs to, and forget it and all earlier ones.

        Answers arrive in order. If several requests of one form are open, the answer counts as that to the oldest,
        unless answers come as quickly after the newest as they usually do, several times in a row.
        """
        now = time.monotonic()
        same = [asked for form, asked in self._open if form == way and now - asked < LATEST_ANSWER_S]
        certain = len(same) <= 1
        if certain:
            self._fastest_s = min(self._fastest_s, now - began_s)
        self._quick = self._quick + 1 if now - began_s < QUICK_FACTOR * self._fastest_s else 0
        asked_s = began_s if certain or self._quick >= QUICK_ANSWERS else same[0]
        self._asked_s = max(self._asked_s, asked_s)
        self._open = deque(each for each in self._open if each[1] > asked_s)

    def _wait(self, wait_s: float) -> float:
        """Set the time limit for the next answer."""
        client = self._ready()
        client.comm_params.timeout_connect = client.transaction.comm_params.timeout_connect = wait_s
        # By default, pymodbus closes a socket after a few consecutive lost frames.
        client.transaction.count_until_disconnect = client.transaction.max_until_disconnect
        if not isinstance(client.socket, socket.socket):
            client.socket.timeout = wait_s
        return wait_s

    def _drain(self) -> None:
        """Discard unexpected bytes; after a failure, until the line has been silent for long enough.

        Raises OSError if the peer has closed the connection.
        """
        quiet_s = QUIET_S if self._unsettled else 0.0
        link = self._ready().socket
        waits_until = time.monotonic() + self._timeout_s + quiet_s
        while time.monotonic() < waits_until:
            if isinstance(link, socket.socket):
                came, _, _ = select.select([link], [], [], quiet_s)
                if not came:
                    break
                if not link.recv(4096):
                    raise ConnectionResetError("the other end has closed the connection")
            else:
                if not link.in_waiting:
                    time.sleep(quiet_s)
                if not (waiting := link.in_waiting):
                    break
                link.read(waiting)
        self._unsettled = False

    def _trace(self, sending: bool, data: bytes) -> bytes:
        self._heard = self._heard or (not sending and bool(data))
        return data

    def _spoilt(self, what: str) -> ProtocolFault:
        self._unsettled = True
        return ProtocolFault(self._device, f"{what} on {self._port}", remedy="check cable, shield and termination")

    def _lost(self) -> ConnectFailed:
        return ConnectFailed(
            self._device,
            f"{self._port} has disappeared or was closed by the other end",
            remedy="check the cable; only one client at a time can use it",
        )


def open_socket(device: str, address: tuple[str, int], timeout_s: float) -> socket.socket:
    """Return a socket connected to host and port. Raises ConnectFailed with a remedy."""
    host, port = address
    try:
        connection = socket.create_connection(address, timeout_s)
    except socket.gaierror as error:
        raise ConnectFailed(device, f"there is no host {host}", remedy="check its name, or use its address") from error
    except ConnectionRefusedError as error:
        raise ConnectFailed(
            device,
            f"{host} does not listen on port {port}",
            remedy="is Robotiq's URCap (with RS485 forwarding, for a tcp:// port) installed and the robot on?",
        ) from error
    except OSError as error:
        raise ConnectFailed(
            device, f"cannot reach {host}:{port}: {error}", remedy="check cable, address and firewall"
        ) from error
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return connection
