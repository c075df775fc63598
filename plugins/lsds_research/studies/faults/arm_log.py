"""The commands that an arm gets after it was stopped: there must be none that moves it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from typing import Any

from lsds.contracts import ArmCommand
from lsds.registry.in_program import register, unregister

_NUMBERS = count(1)


class ArmLog:
    """A `Fault` of the arm that changes nothing and counts. As the last fault of a config it is outside the others, so
    it counts what the project sends, not what a faulty arm makes of it.

    `stops` is the number of stop commands since the arm was armed; `moves` that of commands with a velocity, and
    `moves_after_stop` that of those after the first stop. Stop commands and zero velocities are no movement.
    """

    target = "arm"
    moment = "start"

    def __init__(self) -> None:
        self.stops = self.moves = self.moves_after_stop = 0

    def around(self, part: Any) -> Any:
        """Return the arm, counted."""
        return _Counted(part, self)


class _Counted:
    def __init__(self, part: Any, log: ArmLog) -> None:
        self._part, self._log = part, log

    def __getattr__(self, name: str) -> Any:
        return getattr(self._part, name)

    def arm(self) -> None:
        self._log.stops = self._log.moves = self._log.moves_after_stop = 0
        self._part.arm()

    def stop(self) -> None:
        self._log.stops += 1
        self._part.stop()

    def command(self, command: ArmCommand) -> ArmCommand:
        if any((*command.twist.linear_m_s, *command.twist.angular_rad_s)):
            self._log.moves += 1
            self._log.moves_after_stop += self._log.stops > 0
        sent: ArmCommand = self._part.command(command)
        return sent


@contextmanager
def arm_log() -> Iterator[tuple[str, ArmLog]]:
    """Yield the name of a fault for a config, and the log that it fills; the name is valid in the body only."""
    name, log = f"arm-log-{next(_NUMBERS)}", ArmLog()
    register("fault", name, lambda: log)
    try:
        yield name, log
    finally:
        unregister("fault", name)
