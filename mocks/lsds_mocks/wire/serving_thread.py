"""Calls from other threads, carried out by the thread that serves: a mock's state then needs no locks."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from lsds.errors import DeviceError

CALL_ANSWER_S = 2.0
"""Time within which the serving thread has to carry out a call (s); it looks for calls at least every 20 ms."""
Result = TypeVar("Result")


class ServingThread:
    """Carries out calls on the thread inside `serving`, at its next `turn`; outside of it, on the caller's thread."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._calls: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._owner: threading.Thread | None = None

    @contextmanager
    def serving(self) -> Iterator[None]:
        """Make the present thread the serving one."""
        self._owner = threading.current_thread()
        try:
            yield
        finally:
            self._owner = None
            self.turn()

    def turn(self) -> None:
        """Carry out the calls that wait."""
        while not self._calls.empty():
            self._calls.get()()

    def run(self, work: Callable[[], Result]) -> Result:
        """Return the result of `work`, or raise its exception. Raises DeviceError if the serving thread is stuck."""
        if self._owner in (None, threading.current_thread()):
            return work()
        results: queue.SimpleQueue[tuple[Any, BaseException | None]] = queue.SimpleQueue()

        def carry_out() -> None:
            try:
                results.put((work(), None))
            except Exception as error:
                results.put((None, error))

        self._calls.put(carry_out)
        try:
            result, error = results.get(timeout=CALL_ANSWER_S)
        except queue.Empty:
            raise DeviceError(f"mock {self._name}", f"has not served for {CALL_ANSWER_S:g} s") from None
        if error is not None:
            raise error
        return result  # type: ignore[no-any-return]
