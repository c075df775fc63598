"""Event loop of one thread: readable descriptors and scheduled calls, on the rig's clock."""

from __future__ import annotations

import heapq
import selectors
from collections.abc import Callable
from typing import TYPE_CHECKING

from lsds.clock import seconds

if TYPE_CHECKING:
    from lsds.clock import Clock


class Reactor:
    """Waits for input and scheduled calls with `select`; `epoll` would round waits up to whole milliseconds."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._selector = selectors.SelectSelector()
        self._calls: list[tuple[int, int, Callable[[], None]]] = []
        self._number = 0

    def now(self) -> int:
        """Return the present (ns)."""
        return self._clock.now()

    def watch(self, fd: int, readable: Callable[[], None]) -> None:
        """Call `readable` whenever a descriptor has data to read."""
        self._selector.register(fd, selectors.EVENT_READ, readable)

    def unwatch(self, fd: int) -> None:
        """Stop watching a descriptor."""
        self._selector.unregister(fd)

    def call_at(self, t_ns: int, call: Callable[[], None]) -> None:
        """Schedule one call; calls for the same time run in the order of their requests."""
        heapq.heappush(self._calls, (t_ns, self._number, call))
        self._number += 1

    def turn(self, longest_ns: int) -> None:
        """Wait for the first event, at most `longest_ns`, and handle all events that are due."""
        wait = longest_ns
        if self._calls:
            wait = min(wait, self._calls[0][0] - self.now())
        for key, _ in self._selector.select(max(0.0, seconds(wait))):
            # An earlier event of the same turn may have closed it.
            if key.fd in self._selector.get_map():
                key.data()
        now = self.now()
        while self._calls and self._calls[0][0] <= now:
            heapq.heappop(self._calls)[2]()

    def close(self) -> None:
        """Forget everything."""
        self._calls.clear()
        self._selector.close()
