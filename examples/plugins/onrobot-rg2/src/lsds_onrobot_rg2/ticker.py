"""A thread that calls the pump at a fixed rate."""

from __future__ import annotations

import threading

from lsds.clock import Clock

from lsds_onrobot_rg2.pump import Pump


class ThreadTicker:
    """A `Ticker` in real time."""

    def __init__(self, name: str, rate_hz: float, clock: Clock) -> None:
        self._name = name
        self._period_s = 1.0 / rate_hz
        self._clock = clock
        self._ended = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self, pump: Pump) -> None:
        """Start the thread."""
        self._thread = threading.Thread(target=self._run, args=(pump,), name=self._name, daemon=True)
        self._thread.start()

    def catch_up(self) -> None:
        """Nothing to do: the thread keeps its rate."""

    def stop(self) -> None:
        """End the thread, and wait for its last request."""
        self._ended.set()
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.join()

    def _run(self, pump: Pump) -> None:
        while not self._ended.wait(self._period_s):
            pump.step(self._clock.now())
