"""The interface of all picture sources."""

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
    """One picture: uint8 RGB (height, width, 3), not modified later.

    `arrived_ns` is the arrival of its first bytes on the monotonic clock; `stamp_ns` the device's time stamp, on the
    device's clock; `number` the device's count. The last two are None if the device does not provide them.
    """

    image: NDArray[np.uint8]
    arrived_ns: int
    stamp_ns: int | None = None
    number: int | None = None


class FrameSource(Protocol):
    """A camera that is read by one thread. Only `interrupt` may be called from another."""

    def open(self, timeout_s: float) -> None:
        """Open it. Raises ConnectFailed with a remedy."""
        ...

    def shot(self, timeout_s: float) -> Shot:
        """Wait for the next picture. Raises DataError for a damaged picture, DeviceError if the camera is lost or
        silent, EOFError at the end of a recording."""
        ...

    def interrupt(self) -> None:
        """End a `shot` that waits in another thread, if the source supports it."""
        ...

    def close(self) -> None:
        """Release the camera; it can be opened again. Never raises."""
        ...
