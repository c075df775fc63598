"""From the controller's time to ours."""

from __future__ import annotations

from collections import deque

WINDOW = 64
"""Arrivals among which the fastest is looked for: a quarter of a second at 250 Hz.

Long enough to meet an undelayed one, short enough to learn soon of a controller whose clock has stood still.
"""


class ClockMap:
    """Learns the offset between the controller's timestamps and the monotonic clock from the fastest recent package.

    What delays a package only makes it later, so that the smallest difference seen is the nearest to the truth.
    """

    def __init__(self) -> None:
        self._offsets: deque[int] = deque(maxlen=WINDOW)

    def to_monotonic(self, controller_s: float, arrived_ns: int) -> int:
        """Return when a sample was taken (ns), never later than it arrived."""
        theirs = round(controller_s * 1e9)
        self._offsets.append(arrived_ns - theirs)
        return theirs + min(self._offsets)
