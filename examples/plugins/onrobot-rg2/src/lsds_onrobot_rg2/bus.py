"""The registers of the gripper over Modbus TCP, by pymodbus."""

from __future__ import annotations

import logging
from typing import Any, Protocol

from lsds.errors import ConnectFailed, ConnectionLost, DeviceTimeout, ProtocolFault

from lsds_onrobot_rg2.options import Options

_REMEDIES = {
    2: "check that the gripper at this unit is an RG2",
    10: "check that a gripper is connected to the Compute Box",
    11: "check the cable between Compute Box and gripper",
}
"""Remedies by Modbus exception code; 10 and 11 are those of a gateway."""


class Bus(Protocol):
    """Registers of the gripper: over Modbus, or those of a mock in this process."""

    def open(self) -> None:
        """Connect without moving. Raises ConnectFailed."""
        ...

    def close(self) -> None:
        """Release the connection. A second call does nothing."""
        ...

    def read(self, address: int, count: int) -> list[int]:
        """Return the values of registers. Raises DeviceError."""
        ...

    def write(self, address: int, words: list[int]) -> None:
        """Write registers. Raises DeviceError."""
        ...


class ModbusBus:
    """A `Bus` on TCP. Any failure closes the connection, and the next request opens another.

    Thus a late answer never belongs to a later request.
    """

    def __init__(self, device: str, options: Options) -> None:
        self._device = device
        self._options = options
        self._where = f"{options.host}:{options.port}, unit {options.unit}"
        self._client: Any = None

    def open(self) -> None:
        """Connect. Raises ConnectFailed."""
        from pymodbus.client import ModbusTcpClient

        # pymodbus logs each failure; here it becomes an error. Configured logging still shows it.
        logging.getLogger("pymodbus").addHandler(logging.NullHandler())
        self.close()
        host, port = self._options.host, self._options.port
        client: Any = ModbusTcpClient(host, port=port, timeout=self._options.timeout_s, retries=0)
        if not client.connect():
            problem = f"no connection to {host}:{port}"
            raise ConnectFailed(self._device, problem, remedy="check power, cable and address of the Compute Box")
        self._client = client

    def close(self) -> None:
        """Release the connection."""
        client, self._client = self._client, None
        if client is not None:
            client.close()

    def read(self, address: int, count: int) -> list[int]:
        """Return the values of holding registers. Raises DeviceError."""
        what = f"reading registers {address} to {address + count - 1}"
        words = list(self._ask(what, "read_holding_registers", address, count=count).registers)
        if len(words) != count:
            raise self._wrong(f"{len(words)} registers in answer to {what}")
        return words

    def write(self, address: int, words: list[int]) -> None:
        """Write holding registers. Raises DeviceError."""
        what = f"writing registers {address} to {address + len(words) - 1}"
        answer = self._ask(what, "write_registers", address, words)
        if (answer.address, answer.count) != (address, len(words)):
            raise self._wrong(f"the answer to another write than {what}")

    def _ask(self, what: str, request: str, *arguments: Any, **keywords: Any) -> Any:
        from pymodbus.exceptions import ConnectionException, ModbusException, ModbusIOException

        if self._client is None:
            self.open()
        try:
            answer = getattr(self._client, request)(*arguments, device_id=self._options.unit, **keywords)
        except ModbusIOException as error:
            self.close()
            problem = f"no valid answer from {self._where} to {what} within {self._options.timeout_s} s"
            raise DeviceTimeout(self._device, problem, remedy="check the gripper's power and its unit") from error
        except (ConnectionException, OSError) as error:
            self.close()
            problem = f"the connection to {self._where} was lost"
            raise ConnectionLost(self._device, problem, remedy="check the Compute Box and its network") from error
        except (ModbusException, ArithmeticError, LookupError, TypeError, ValueError) as error:
            raise self._wrong(f"an answer to {what} that cannot be decoded ({error})") from error
        if answer.isError():
            code = answer.exception_code
            raise self._wrong(f"Modbus exception {code} to {what}", _REMEDIES.get(code))
        if not hasattr(answer, "registers" if request.startswith("read") else "address"):
            raise self._wrong(f"an answer of another function to {what}")
        return answer

    def _wrong(self, problem: str, remedy: str | None = None) -> ProtocolFault:
        self.close()
        return ProtocolFault(self._device, f"{self._where}: {problem}", remedy=remedy or "check the gripper's firmware")
