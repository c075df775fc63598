"""What every source of pictures can do, whatever bus it is on."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Reduction = Callable[[int, int], int]
"""From the size (width, height) of a JPEG to the factor (1, 2, 4 or 8) by which it may be decoded smaller."""


def whole(width: int, height: int) -> int:
    """Return 1: decode at full size."""
    return 1


class Shot(NamedTuple):
    """One picture: uint8 RGB (height, width, 3), which nobody writes to again.

    `arrived_ns` is when its first bytes came, on the monotonic clock; `stamp_ns` the device's own time of it, on
    whatever clock the device keeps; `number` the device's own count. Both None where the device does not tell.
    """

    image: NDArray[np.uint8]
    arrived_ns: int
    stamp_ns: int | None = None
    number: int | None = None


class FrameSource(Protocol):
    """A camera that is read by one thread. Only `interrupt` may be called from another."""

    def open(self, timeout_s: float) -> None:
        """Open it. Raises ConnectFailed with what a person can do about it."""
        ...

    def shot(self, timeout_s: float) -> Shot:
        """Wait for the next picture. Raises DataError for one damaged picture, DeviceError where the camera is gone
        or silent, EOFError where a recording has ended."""
        ...

    def interrupt(self) -> None:
        """Make a `shot` that waits in another thread give up soon, where the source can."""
        ...

    def close(self) -> None:
        """Give the camera back; it can be opened again. Never raises."""
        ...
