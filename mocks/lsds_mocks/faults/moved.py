"""What faults of a gripper and of an arm have in common: both tell a state and take commands."""

from __future__ import annotations

from typing import Any

from lsds_mocks.faults.plan import Around


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
