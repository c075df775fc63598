"""Estimate the exposure time of a picture.

The best source is the device's time stamp, if it uses this machine's monotonic clock: the kernel stamps UVC frames this
way (first packet, after exposure), and a mock on loopback stamps the exposure. A network camera uses its own clock, so
the arrival of the picture's first byte is used instead. The delay measured by the user is subtracted in both cases.
"""

from __future__ import annotations

from typing import Literal

from lsds.clock import nanoseconds

StampPolicy = Literal["auto", "arrival"]

OLDEST_NS = nanoseconds(1.0)
"""A stamp older than this on arrival belongs to another clock."""


class ExposureTimes:
    """Converts arrivals and stamps to strictly increasing exposure times.

    `auto` uses the device's stamp if it is within one second before the arrival, else the arrival. `delay_s` is
    subtracted from both: the known delay of exposure, readout and transport.
    """

    def __init__(self, policy: StampPolicy, delay_s: float = 0.0) -> None:
        self._policy = policy
        self._delay_ns = nanoseconds(delay_s)
        self._last_ns: int | None = None
        self.from_device = False
        """Whether the last time was the device's time stamp."""

    def of(self, arrived_ns: int, stamp_ns: int | None) -> int:
        """Return the exposure's time (monotonic ns), later than that of any picture before."""
        plausible = stamp_ns is not None and 0 <= arrived_ns - stamp_ns <= OLDEST_NS
        self.from_device = plausible and self._policy == "auto"
        t_ns = (stamp_ns if self.from_device and stamp_ns is not None else arrived_ns) - self._delay_ns
        if self._last_ns is not None and t_ns <= self._last_ns:
            # Two pictures cannot have the same time; the later one was exposed after the earlier one.
            t_ns = self._last_ns + 1
        self._last_ns = t_ns
        return t_ns


class FrameNumbers:
    """Converts a device's counts to increasing sequence numbers, with a gap for every lost picture."""

    def __init__(self) -> None:
        self._next = 0
        self._device: int | None = None

    def of(self, number: int | None) -> int:
        """Return the number of a picture, from the device's count if it has one that continues from the last."""
        step = 1
        if number is not None and self._device is not None and number > self._device:
            step = number - self._device
        given = self._next + step - 1
        self._device = number
        self._next = given + 1
        return given

    def restart(self) -> None:
        """Report that the device was reopened and may count from zero again."""
        self._device = None
