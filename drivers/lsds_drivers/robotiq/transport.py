"""What the I/O thread needs of a way to the gripper, whichever protocol it speaks."""

from __future__ import annotations

from typing import Protocol

from lsds_drivers.robotiq.registers import Motion, Status


class Transport(Protocol):
    """One request at a time, each in bounded time.

    Raises ConnectFailed where the connection itself is gone (it is closed then), DeviceTimeout where no answer came,
    ProtocolFault where the answer cannot be right.
    """

    @property
    def is_open(self) -> bool:
        """Whether requests can be made."""
        ...

    def open(self, timeout_s: float) -> None:
        """Open it. Raises ConnectFailed with a remedy."""
        ...

    def close(self) -> None:
        """Give the port or socket back. Never raises; does nothing where it is closed."""
        ...

    def read(self) -> Status:
        """Ask for the status."""
        ...

    def write(self, action: int, motion: Motion | None) -> None:
        """Write the action byte, and a motion where there is one; the request's counts stay as they are without."""
        ...
