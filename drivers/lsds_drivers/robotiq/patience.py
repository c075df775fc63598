"""How long to wait for an answer before asking again: as long as answers take on this line, not as long as they may."""

from __future__ import annotations

_TIMES, _MORE_S = 2.0, 0.005
"""An answer is given up after so many times the slowest of late, and a little more."""
_FORGETS = 0.98
"""Share of the slowest that remains with each faster answer."""
_STEADY = 8
"""Silences in a row after which the wait grows: the line may have become slower than it was."""


class Patience:
    """Learns from answers. The wait is between `least_s` and `most_s`, which is what the first answer gets."""

    def __init__(self, least_s: float, most_s: float) -> None:
        self._least_s = min(least_s, most_s)
        self._most_s = most_s
        self._slowest_s = most_s
        self._silences = 0

    @property
    def wait_s(self) -> float:
        """Time to wait for the next answer."""
        wait_s = max(self._least_s, _TIMES * self._slowest_s + _MORE_S)
        doublings = min(max(0, self._silences - _STEADY + 1), 16)
        return min(self._most_s, wait_s * float(2**doublings))

    def answered(self, after_s: float) -> None:
        """Learn that an answer came after a time."""
        self._slowest_s = max(after_s, _FORGETS * self._slowest_s if self._slowest_s < self._most_s else 0.0)
        self._silences = 0

    def silent(self) -> None:
        """Learn that none came."""
        self._silences += 1

    def late(self) -> None:
        """Learn that one came when it had been given up."""
        self._slowest_s = min(self._most_s, max(self._slowest_s, self.wait_s))
