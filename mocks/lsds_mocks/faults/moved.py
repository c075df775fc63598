"""Base classes for faults of a gripper and of an arm, both of which report a state and take commands."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from typing import Any

from lsds.clock import nanoseconds
from lsds_mocks.faults.plan import Around, Plan


class Moved(Around):
    """A moving device with a fault: `reported` changes the state, `sent` changes a command or drops it (None)."""

    def read(self) -> Any:
        """Return the newest state, changed while the fault is on."""
        state = self._part.read()
        return self.reported(state) if self._plan.on else state

    def command(self, command: Any) -> Any:
        """Send a command, changed or dropped while the fault is on; return the command that was sent."""
        wanted = self.sent(command) if self._plan.on else command
        return command if wanted is None else self._part.command(wanted)

    def reported(self, state: Any) -> Any:
        """Return the state to report while the fault is on."""
        return state

    def sent(self, command: Any) -> Any | None:
        """Return the command to send while the fault is on, or None to drop it."""
        return command


class Frozen(Moved):
    """A device that keeps reporting its state from the moment when the fault began."""

    _last: Any = None

    def reported(self, state: Any) -> Any:
        """Return the first state that was read while the fault was on."""
        self._last = state if self._last is None else self._last
        return self._last


class Later(Moved):
    """Delays commands: each is sent, in order, at the first call after its delay.

    Commands that still wait when the fault ends are lost, because a newer command overtakes them.
    """

    _lifetime_s = 0.1

    def __init__(self, part: Any, plan: Plan) -> None:
        super().__init__(part, plan)
        self._waiting: deque[tuple[int, Any]] = deque()

    def read(self) -> Any:
        """Send the commands that are due, then return the newest state."""
        self._send()
        return super().read()

    def command(self, command: Any) -> Any:
        """Send a command, now or later."""
        if not self._plan.on:
            self._waiting.clear()
        return super().command(command)

    def sent(self, command: Any) -> Any | None:
        """Queue a command; return None, because it is sent later."""
        self._waiting.append((self._plan.clock.now() + nanoseconds(self._plan.level), command))
        self._send()
        return None

    def stop(self) -> None:
        """Stop the device and drop all queued commands."""
        self._waiting.clear()
        self._part.stop()

    def _send(self) -> None:
        now = self._plan.clock.now()
        while self._waiting and self._waiting[0][0] <= now:
            _, command = self._waiting.popleft()
            self._part.command(replace(command, expires_ns=now + nanoseconds(self._lifetime_s)))
