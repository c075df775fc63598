"""Observers (recorder, live view) behind bounded queues: a slow observer loses samples and never delays the loop."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

T = TypeVar("T")

LONGEST_SLEEP_S = 0.05
"""Longest time for which an item waits in the queue of a sleeping observer, s; chosen."""


@dataclass(frozen=True, slots=True)
class ObserverStatistics:
    """Statistics of one observer. `failure` is the reason why it was removed, empty if it was not."""

    name: str
    delivered: int
    dropped: int
    failure: str


class Observers(Generic[T]):
    """Passes every published item to each observer.

    `threaded=True` (wall clock): each observer has its own thread and its own queue of `queue` items; when it
    is full the oldest item is dropped and counted. `threaded=False` (virtual clock): observers run inline, in the order
    in which they were added, and nothing is dropped. An observer that raises is removed; the others continue.
    """

    def __init__(self, *, threaded: bool, queue: int = 256) -> None:
        self._threaded = threaded
        self._queue = queue
        self._outlets: list[_Outlet[T]] = []
        self._closed = False

    def add(self, name: str, observe: Callable[[T], object], close: Callable[[], object] | None = None) -> None:
        """Add an observer; `close` is called once after its last item. Raises ValueError if the name is in use."""
        if any(outlet.name == name for outlet in self._outlets):
            raise ValueError(f"an observer named '{name}' already exists")
        outlet = _ThreadedOutlet(name, observe, close, self._queue) if self._threaded else _Outlet(name, observe, close)
        self._outlets.append(outlet)

    @property
    def used(self) -> bool:
        """Whether anybody observes."""
        return bool(self._outlets)

    def publish(self, item: T, *, wake: bool = True) -> None:
        """Pass an item to every observer. Never raises and never waits for a threaded observer.

        With `wake=False` a sleeping thread takes the item together with the next one, or at most `LONGEST_SLEEP_S`
        later: what it does with a new frame does not compete for the processor with the answer to that frame.
        """
        if not self._closed:
            for outlet in self._outlets:
                outlet.put(item, wake)

    def statistics(self) -> tuple[ObserverStatistics, ...]:
        """Return the statistics of each observer, in the order in which they were added."""
        return tuple(outlet.statistics() for outlet in self._outlets)

    def close(self, timeout_s: float = 2.0) -> None:
        """Let every observer finish its queue, for at most `timeout_s` each. A second call does nothing."""
        if not self._closed:
            self._closed = True
            for outlet in self._outlets:
                outlet.close(timeout_s)

    def __enter__(self) -> Observers[T]:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Outlet(Generic[T]):
    """One observer, called inline."""

    def __init__(self, name: str, observe: Callable[[T], object], close: Callable[[], object] | None) -> None:
        self.name = name
        self._observe = observe
        self._close = close
        self._delivered = 0
        self._dropped = 0
        self._failure = ""

    def put(self, item: T, wake: bool) -> None:
        self._deliver(item)

    def close(self, timeout_s: float) -> None:
        self._finish()

    def statistics(self) -> ObserverStatistics:
        return ObserverStatistics(self.name, self._delivered, self._dropped, self._failure)

    def _deliver(self, item: T) -> None:
        if self._failure:
            self._dropped += 1
            return
        try:
            self._observe(item)
        except Exception as error:
            self._failure = f"{type(error).__name__}: {error}"
            self._dropped += 1
        else:
            self._delivered += 1

    def _finish(self) -> None:
        if self._close is not None:
            try:
                self._close()
            except Exception as error:
                self._failure = self._failure or f"closing: {type(error).__name__}: {error}"


class _ThreadedOutlet(_Outlet[T]):
    """One observer in its own thread, behind a drop-oldest queue."""

    def __init__(
        self, name: str, observe: Callable[[T], object], close: Callable[[], object] | None, queue: int
    ) -> None:
        super().__init__(name, observe, close)
        self._items: deque[T] = deque()
        self._room = queue
        self._overflow = 0
        self._ended = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._pump, name=f"lsds-observer-{name}", daemon=True)
        self._thread.start()

    def put(self, item: T, wake: bool) -> None:
        with self._changed:
            if len(self._items) >= self._room:
                self._items.popleft()
                self._overflow += 1
            self._items.append(item)
            if wake:
                self._changed.notify()

    def close(self, timeout_s: float) -> None:
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._thread.join(timeout_s)
        if self._thread.is_alive():
            with self._changed:
                self._overflow += len(self._items)
                self._items.clear()
            self._failure = self._failure or f"did not finish within {timeout_s} s"

    def statistics(self) -> ObserverStatistics:
        return ObserverStatistics(self.name, self._delivered, self._dropped + self._overflow, self._failure)

    def _pump(self) -> None:
        while True:
            with self._changed:
                while not self._items and not self._ended:
                    self._changed.wait(LONGEST_SLEEP_S)
                if not self._items:
                    break
                item = self._items.popleft()
            self._deliver(item)
        self._finish()
