"""The gripper's registers over Modbus RTU, by pymodbus: on a serial port, or RTU frames over TCP."""

from __future__ import annotations

import logging
import select
import socket
import time
from typing import TYPE_CHECKING, Any

from lsds.errors import ConnectFailed, DeviceTimeout, ProtocolFault
from lsds_drivers.robotiq.options import tcp_address
from lsds_drivers.robotiq.registers import COMMAND_REGISTER, STATUS_REGISTER, Motion, Status, command_words
from lsds_drivers.robotiq.serial_port import open_serial

if TYPE_CHECKING:
    from pymodbus.client import ModbusSerialClient, ModbusTcpClient

_HOLDING, _INPUT, _WRITE = 3, 4, 16
QUIET_S = 0.02
"""Silence after which no late answer can arrive: a USB adapter may delay one by 16 ms."""


class ModbusTransport:
    """A `Transport` on a serial port or, for tcp://host:port, on a socket that carries the same frames.

    RTU answers do not identify their request. So that a late answer is not assigned to the next request, the line must
    be silent after any failure, and the status is then requested with the other of functions 3 and 4.
    """

    def __init__(self, device: str, port: str, slave: int, baud: int, timeout_s: float) -> None:
        self._device = device
        self._port = port
        self._slave = slave
        self._baud = baud
        self._timeout_s = timeout_s
        self._client: ModbusSerialClient | ModbusTcpClient | None = None
        self._function = _INPUT
        self._heard = False
        self._unsettled = False

    @property
    def is_open(self) -> bool:
        """Whether requests can be made."""
        return self._client is not None and self._client.socket is not None

    def open(self, timeout_s: float) -> None:
        """Open port or socket. Raises ConnectFailed with a remedy."""
        from pymodbus import FramerType
        from pymodbus.client import ModbusSerialClient, ModbusTcpClient

        self.close()
        # pymodbus logs a warning for every damaged answer; here they are counted and reported with the error. They
        # still appear # if logging is configured.
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
        function = self._function
        client = self._ready()
        ask = client.read_holding_registers if function == _HOLDING else client.read_input_registers
        answer = self._exchange(ask, STATUS_REGISTER, count=3)
        if answer.function_code != function or len(answer.registers) != 3:
            raise self._spoilt("an answer that belongs to another request")
        return Status.from_registers(answer.registers)

    def write(self, action: int, motion: Motion | None) -> None:
        """Write one command register, or all three."""
        words = command_words(action, motion)
        answer = self._exchange(self._ready().write_registers, COMMAND_REGISTER, words)
        if answer.function_code != _WRITE or (answer.address, answer.count) != (COMMAND_REGISTER, len(words)):
            raise self._spoilt("an answer that belongs to another request")

    # -- inside -------------------------------------------------------------------------------------------

    def _ready(self) -> Any:
        client = self._client
        # Without its socket pymodbus would open one of its own.
        if client is None or client.socket is None:
            raise self._lost()
        return client

    def _exchange(self, ask: Any, *arguments: Any, **keywords: Any) -> Any:
        from pymodbus.exceptions import ConnectionException, ModbusException, ModbusIOException

        self._heard = False
        try:
            self._drain()
            answer = ask(*arguments, device_id=self._slave, **keywords)
        except ModbusIOException as error:
            if self._heard:
                raise self._spoilt("a damaged answer") from error
            self._turn()
            raise DeviceTimeout(
                self._device,
                f"no answer on {self._port} within {1e3 * self._timeout_s:.0f} ms",
                remedy=f"check the gripper's 24 V, its cable, and that it is slave {self._slave}",
            ) from error
        except (ConnectionException, OSError) as error:
            self.close()
            raise self._lost() from error
        except (ModbusException, ArithmeticError, LookupError, TypeError, ValueError) as error:
            raise self._spoilt(f"an answer that cannot be decoded ({error})") from error
        if answer.isError():
            raise self._spoilt("a Modbus exception, which this gripper does not know")
        return answer

    def _drain(self) -> None:
        """Discard unexpected bytes; after a failure, until the line has been silent for long enough.

        Raises OSError where the other end has gone.
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

    def _turn(self) -> None:
        self._unsettled = True
        self._function = _HOLDING if self._function == _INPUT else _INPUT

    def _spoilt(self, what: str) -> ProtocolFault:
        self._turn()
        return ProtocolFault(self._device, f"{what} on {self._port}", remedy="check cable, shield and termination")

    def _lost(self) -> ConnectFailed:
        return ConnectFailed(
            self._device,
            f"{self._port} has gone away or was closed by the other end",
            remedy="check the cable; one client at a time can have it",
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
