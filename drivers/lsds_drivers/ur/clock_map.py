"""Map the controller's time to the monotonic clock."""

from __future__ import annotations

from collections import deque

ARRIVALS_WINDOW = 64
"""Number of arrivals among which the fastest is used: a quarter of a second at 250 Hz.

The window is long enough to contain an undelayed arrival, and short enough to adapt soon after the controller's clock
has stopped for a while.
"""


class ClockMap:
    """Estimates the offset between the controller's time stamps and the monotonic clock from the fastest recent
    package.

    A delay can only make a package later, so the smallest difference is closest to the true offset.
    """

    def __init__(self) -> None:
        self._offsets: deque[int] = deque(maxlen=ARRIVALS_WINDOW)

    def to_monotonic(self, controller_s: float, arrived_ns: int) -> int:
        """Return when a sample was taken (ns), never later than it arrived."""
        theirs = round(controller_s * 1e9)
        self._offsets.append(arrived_ns - theirs)
        return theirs + min(self._offsets)
