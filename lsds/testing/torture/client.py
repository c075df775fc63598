"""Contract of a client under test: a small class around any driver or library. It runs in a separate process.

Instances are made in the order connect, use, close. Any exception is a proper answer to a fault; what counts as a
finding is a call that hangs, a process that dies, a wrong value returned as if it were right, fingers that open, and a
device that moves on.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Client(Protocol):
    """Attributes of every client under test.

    `transport` is the face of the mock that the client speaks to, "" for the usual one; `options` are those of the
    mock. Both may be left out.
    """

    transport: ClassVar[str]
    options: ClassVar[Mapping[str, Any]]

    def __init__(self, address: str) -> None:
        """Connect to the mock at an address as `lsds mock` prints it."""
        ...

    def close(self) -> None:
        """Release the connection."""
        ...


class GripperClient(Client, Protocol):
    """A client of a gripper."""

    def move(self, aperture_m: float, speed_m_s: float) -> None:
        """Send the fingers to an aperture, and return without waiting for their arrival."""
        ...

    def read(self) -> float:
        """Return the aperture that the gripper reports now (m)."""
        ...


class ArmClient(Client, Protocol):
    """A client of an arm."""

    def move(self, speed_m_s: float) -> None:
        """Move the TCP up at a speed; called at 20 Hz. Use the library's time limit of a command, if it has one."""
        ...

    def stop(self) -> None:
        """Stop the arm."""
        ...

    def read(self) -> float:
        """Return the height of the TCP that the arm reports now (m)."""
        ...


class CameraClient(Client, Protocol):
    """A client of a camera."""

    def read(self) -> NDArray[np.uint8]:
        """Return a new image (height, width, 3) in RGB or BGR."""
        ...
