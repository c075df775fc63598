"""The interface of a connection to the gripper, for the I/O thread."""

from __future__ import annotations

from typing import Protocol

from lsds_drivers.robotiq.registers import Motion, Status


class Transport(Protocol):
    """One request at a time, each in bounded time.

    Raises ConnectFailed if the connection is lost (it is closed then), DeviceTimeout without an answer, ProtocolFault
    for an invalid answer.
    """

    @property
    def is_open(self) -> bool:
        """True if requests can be made."""
        ...

    @property
    def waited_s(self) -> float:
        """Time (s) since the earliest request that the last answer may belong to."""
        ...

    def open(self, timeout_s: float) -> None:
        """Open it. Raises ConnectFailed with a remedy."""
        ...

    def close(self) -> None:
        """Close the port or socket. Never raises; does nothing if it is closed."""
        ...

    def read(self) -> Status:
        """Request the status."""
        ...

    def write(self, action: int, motion: Motion | None) -> None:
        """Write the action byte and, unless None, a motion; without one the requested counts stay unchanged."""
        ...
