"""Work budget of programs, in units that are refilled in every control cycle.

A unit is about 40 ns of an ordinary processor. Units are counted, not measured, so that a program ends at the same
statement on every machine. The compiled program pays for its statements in advance; functions with a cost that depends
on a size pay for that size.
"""

from __future__ import annotations

from lsds_mocks.wire.ur.script.errors import ScriptError

CYCLE = 15_000
"""Units added per cycle: the part of two milliseconds that programs may use continuously."""

BURST = 400_000
"""Maximum number of saved units, which a program may spend in one cycle, for example on a long initial calculation."""

THREAD = 40
"""Price of resuming a thread, units of work; chosen."""
FRAME = 4
"""Price of each function in which a resumed thread waits, units of work; chosen."""


class Work:
    """The budget of one controller, shared by all its programs. `frames` counts the functions that now wait."""

    __slots__ = ("_start", "frames", "left")

    def __init__(self) -> None:
        self.left = BURST
        self.frames = 0
        self._start = BURST

    def begin(self) -> None:
        """Begin a control cycle."""
        self._start = self.left = min(BURST, max(self.left, 0) + CYCLE)
        self.left -= FRAME * self.frames

    @property
    def spent(self) -> int:
        """Units spent in this cycle."""
        return self._start - max(self.left, 0)

    def spend(self, units: int) -> None:
        """Pay for the next work. Raises ScriptError if the budget is exhausted."""
        if units > self.left:
            self.left = 0
            exhausted()
        self.left -= units


def exhausted(line: int = 0, column: int = 0) -> None:
    """Raise ScriptError for a program that loops or recurses endlessly, or exceeds its time per cycle."""
    raise ScriptError("runtime_error: infinite loop detected: too much is done without sync()", line, column)
