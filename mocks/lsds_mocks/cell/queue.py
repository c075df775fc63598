"""Pending commands to the plant, ordered by the time at which they take effect, not by the order of calls."""

from __future__ import annotations

import heapq
import threading
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lsds_mocks.plant.physics import Physics

Action = Callable[["Physics"], None]
"""The effect of a command on the physics of a cell."""


class CommandQueue:
    """Events (time, source, number) -> action. Posting is safe from any thread and never waits for physics."""

    def __init__(self) -> None:
        self._heap: list[tuple[int, str, int, Action]] = []
        self._count: dict[str, int] = {}
        self._lock = threading.Lock()

    def post(self, t_ns: int, source: str, action: Action) -> None:
        """Let `action` take effect at the first step that starts at or after `t_ns`."""
        with self._lock:
            number = self._count.get(source, 0)
            self._count[source] = number + 1
            heapq.heappush(self._heap, (t_ns, source, number, action))

    def due(self, t_ns: int) -> Iterator[Action]:
        """Remove and yield, in order, the actions that are due at `t_ns`."""
        while self._heap and self._heap[0][0] <= t_ns:
            with self._lock:
                action = heapq.heappop(self._heap)[3]
            yield action

    def clear(self) -> None:
        """Drop all pending actions."""
        with self._lock:
            self._heap.clear()
