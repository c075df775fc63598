"""The watchdog: it stops the cell if the loop is silent. It limits the effect of mistakes and is no safety function.

Nothing here is certified or redundant, and it runs on the computer that it monitors. People are protected by the
emergency stop, the arm's own safety configuration and the layout of the cell, never by this module.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

from lsds.clock import nanoseconds, seconds
from lsds.errors import SafetyStop


class Watchdog:
    """Calls `stop` once if the loop has not called `feed()` for longer than `timeout_s`.

    `now` is a monotonic source in nanoseconds; `doing` returns the call in progress, "" if unknown. `start`
    runs the check in its own thread; the loop calls `feed()` and `check()`, which raises SafetyStop after the watchdog
    has fired. Not used with the virtual clock, where a single thread cannot stall in simulated time.
    """

    def __init__(
        self,
        stop: Callable[[], object],
        timeout_s: float,
        now: Callable[[], int],
        doing: Callable[[], str] = lambda: "",
    ) -> None:
        self._stop = stop
        self._timeout_ns = nanoseconds(timeout_s)
        self._now = now
        self._fed_ns = now()
        self._silence_ns: int | None = None
        self._doing = doing
        self._polled_ns = self._fed_ns
        self._late_ns = 0
        self._cause = ""
        self._failure: str = ""
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def fired(self) -> bool:
        """True if the watchdog has stopped the cell."""
        return self._silence_ns is not None

    def feed(self) -> None:
        """Report that the loop is running."""
        self._fed_ns, self._late_ns = self._now(), 0

    def check(self, cause: Exception | None = None) -> None:
        """Raise SafetyStop if the watchdog has fired, `from` the error that this led to."""
        if self._silence_ns is not None:
            raise SafetyStop(
                f"watchdog: the loop was silent for {seconds(self._silence_ns):.3f} s, the limit is "
                f"{seconds(self._timeout_ns):.3f} s{self._cause}{self._failure}. Find what "
                "blocked the loop (lsds run --json shows the longest run of each task), or increase safety.watchdog_s"
            ) from cause

    def poll(self) -> bool:
        """Check once; call `stop` if the loop has been silent for too long. Return whether the watchdog has fired."""
        now = self._now()
        # The watchdog wakes by the clock alone: where it wakes late, the machine did not run this process.
        late, self._polled_ns = now - self._polled_ns - self._timeout_ns // 4, now
        self._late_ns += max(late, 0)
        silence = now - self._fed_ns
        if self._silence_ns is None and silence > self._timeout_ns:
            self._silence_ns = silence
            self._cause = self._why(silence)
            try:
                self._stop()
            except Exception as error:
                self._failure = f"; and stopping raised {type(error).__name__}: {error}"
        return self.fired

    def _why(self, silence_ns: int) -> str:
        if 2 * self._late_ns > silence_ns:
            return f"; the watchdog itself was not run for {seconds(self._late_ns):.3f} s of it: the machine is busy"
        doing = self._doing()
        return f", in {doing}" if doing else ""

    def start(self) -> None:
        """Start watching. The time of silence counts from now."""
        self.feed()
        self._polled_ns = self._fed_ns
        self._thread = threading.Thread(target=self._watch, name="lsds-watchdog", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop watching. A second call does nothing."""
        self._closing.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(timeout=1.0)

    def __enter__(self) -> Watchdog:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _watch(self) -> None:
        # Check every quarter of the time-out, so that the stop is at most 25 % late.
        while not self._closing.wait(seconds(self._timeout_ns) / 4):
            if self.poll():
                return
