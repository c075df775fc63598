"""What faults of a gripper and of an arm have in common: both tell a state and take commands."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import Any

from lsds.clock import nanoseconds
from lsds_mocks.faults.plan import Around, Plan


class Moved(Around):
    """A device that moves, with a fault: `said` is what it tells of a state, `sent` what becomes of a command (None:
    nothing)."""

    def read(self) -> Any:
        """Return the newest state, as the fault has it."""
        state = self._part.read()
        return self.said(state) if self._plan.on else state

    def command(self, command: Any) -> Any:
        """Send a command, or what the fault leaves of it; return what was sent."""
        wanted = self.sent(command) if self._plan.on else command
        return command if wanted is None else self._part.command(wanted)

    def said(self, state: Any) -> Any:
        """Return what is told of a state while the fault is on."""
        return state

    def sent(self, command: Any) -> Any | None:
        """Return what is sent of a command while the fault is on."""
        return command


class Frozen(Moved):
    """It tells the state of when the fault began, for ever."""

    _last: Any = None

    def said(self, state: Any) -> Any:
        """Return the first state that the fault saw."""
        self._last = state if self._last is None else self._last
        return self._last


class Later(Moved):
    """Commands wait; they are carried out, in their order, at the next call after their time. Those that wait when the
    fault ends are lost: a newer one comes before them."""

    _lifetime_s = 0.1

    def __init__(self, part: Any, plan: Plan) -> None:
        super().__init__(part, plan)
        self._waiting: deque[tuple[int, Any]] = deque()

    def read(self) -> Any:
        """Return the newest state, after what has waited was sent."""
        self._send()
        return super().read()

    def command(self, command: Any) -> Any:
        """Send a command, now or later."""
        if not self._plan.on:
            self._waiting.clear()
        return super().command(command)

    def sent(self, command: Any) -> Any | None:
        """Have a command wait."""
        self._waiting.append((self._plan.clock.now() + nanoseconds(self._plan.level), command))
        self._send()
        return None

    def stop(self) -> None:
        """Stop: nothing that waits is sent any more."""
        self._waiting.clear()
        self._part.stop()

    def _send(self) -> None:
        now = self._plan.clock.now()
        while self._waiting and self._waiting[0][0] <= now:
            _, command = self._waiting.popleft()
            self._part.command(replace(command, expires_ns=now + nanoseconds(self._lifetime_s)))
