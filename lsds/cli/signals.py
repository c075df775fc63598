"""SIGTERM ends a command as Ctrl-C does: the cell is stopped, the grip kept, the results written."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class Terminated(KeyboardInterrupt):
    """SIGTERM has arrived. A KeyboardInterrupt, so that whatever ends well after Ctrl-C ends well after this."""

    exit_code = 143

    def __init__(self) -> None:
        super().__init__("stopped by a request to terminate (SIGTERM)")


@contextmanager
def terminable() -> Iterator[None]:
    """Raise Terminated in the main thread on SIGTERM. Does nothing in another thread, or if a handler is set."""
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGTERM) != signal.SIG_DFL:
        yield
        return
    own = os.getpid()

    def handle(number: int, frame: FrameType | None) -> None:
        if os.getpid() == own:
            raise Terminated
        # A forked process ends as it would without this handler.
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)

    signal.signal(signal.SIGTERM, handle)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
