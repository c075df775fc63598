"""How much programs may do in one control cycle: a budget in units of work, refilled a little every cycle.

A unit is about 40 ns of an ordinary processor. Units are counted, not measured, so that a program ends at the same
place on every machine. The compiled program pays for its statements in advance; functions whose effort depends on a
size pay for that size.
"""

from __future__ import annotations

from lsds_mocks.wire.ur.script.errors import ScriptError

CYCLE = 15_000
"""Units added every cycle: the share of two milliseconds that programs may take for good."""

BURST = 400_000
"""Units that are saved at most. A program may spend them in one cycle, as for a long calculation at its start."""

THREAD, FRAME = 40, 4
"""Price of going on with a thread, and with each of the functions in which it waits."""


class Work:
    """The budget of one controller, shared by all its programs. `frames` counts functions that wait at present."""

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
        """Pay for what is to be done next. Raises ScriptError where it cannot be paid for."""
        if units > self.left:
            self.left = 0
            exhausted()
        self.left -= units


def exhausted(line: int = 0, column: int = 0) -> None:
    """End a program that goes round and round, deeper and deeper, or takes more time than its cycles have."""
    raise ScriptError("runtime_error: infinite loop detected: too much is done without sync()", line, column)
