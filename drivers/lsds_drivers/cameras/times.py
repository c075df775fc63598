"""When a picture was exposed, as well as it can be known.

The best witness is the device's own stamp, but only where it is kept on this machine's monotonic clock: the kernel
stamps UVC frames so (their first packet, after exposure), and a mock on loopback stamps the exposure. A network
camera stamps by a clock of its own, which says nothing here; then the arrival of the picture's first byte counts. From
either the delay is taken off that the user has measured.
"""

from __future__ import annotations

from typing import Literal

from lsds.clock import nanoseconds

StampPolicy = Literal["auto", "arrival"]

OLDEST_NS = nanoseconds(1.0)
"""A stamp older than this on arrival is from another clock."""


class ExposureTimes:
    """Turns arrivals and stamps into exposure times that only go up.

    `auto` takes a device's stamp where it lies within the second before the arrival, else the arrival. `delay_s` is
    taken off either: what the user knows of exposure, readout and transport.
    """

    def __init__(self, policy: StampPolicy, delay_s: float = 0.0) -> None:
        self._policy = policy
        self._delay_ns = nanoseconds(delay_s)
        self._last_ns: int | None = None
        self.from_device = False
        """Whether the last time was the device's own."""

    def of(self, arrived_ns: int, stamp_ns: int | None) -> int:
        """Return the exposure's time (monotonic ns), later than that of any picture before."""
        plausible = stamp_ns is not None and 0 <= arrived_ns - stamp_ns <= OLDEST_NS
        self.from_device = plausible and self._policy == "auto"
        t_ns = (stamp_ns if self.from_device and stamp_ns is not None else arrived_ns) - self._delay_ns
        if self._last_ns is not None and t_ns <= self._last_ns:
            # Two pictures of one instant cannot be; the later is at least as late as the earlier and arrived later.
            t_ns = self._last_ns + 1
        self._last_ns = t_ns
        return t_ns


class FrameNumbers:
    """Turns a device's own counts into numbers that only go up, with a gap wherever a picture was lost on the way."""

    def __init__(self) -> None:
        self._next = 0
        self._device: int | None = None

    def of(self, number: int | None) -> int:
        """Return the number of a picture; by the device's count where it has one and that goes on from the last."""
        step = 1
        if number is not None and self._device is not None and number > self._device:
            step = number - self._device
        given = self._next + step - 1
        self._device = number
        self._next = given + 1
        return given

    def restart(self) -> None:
        """The device was opened anew and may count from zero again."""
        self._device = None
