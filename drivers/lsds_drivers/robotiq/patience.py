"""Adaptive time limit for an answer before the request is repeated, learned from the answers on this line."""

from __future__ import annotations

_SLOWEST_FACTOR = 2.0
"""Factor on the slowest recent answer time in the time limit; chosen."""
_ADDED_WAIT_S = 0.005
"""Time that is added to it in the time limit (s); chosen."""
_FORGETS = 0.98
"""Factor by which each faster answer reduces the remembered slowest answer time."""
_STEADY_MISSES = 8
"""Number of consecutive missing answers after which the wait grows, because the line may have become slower."""


class Patience:
    """Learns from answers. The wait is between `least_s` and `most_s`; it starts with `most_s`."""

    def __init__(self, least_s: float, most_s: float) -> None:
        self._least_s = min(least_s, most_s)
        self._most_s = most_s
        self._slowest_s = most_s
        self._silences = 0

    @property
    def wait_s(self) -> float:
        """Time to wait for the next answer."""
        wait_s = max(self._least_s, _SLOWEST_FACTOR * self._slowest_s + _ADDED_WAIT_S)
        doublings = min(max(0, self._silences - _STEADY_MISSES + 1), 16)
        return min(self._most_s, wait_s * float(2**doublings))

    def answered(self, after_s: float) -> None:
        """Record the time that an answer took."""
        self._slowest_s = max(after_s, _FORGETS * self._slowest_s if self._slowest_s < self._most_s else 0.0)
        self._silences = 0

    def silent(self) -> None:
        """Record a missing answer."""
        self._silences += 1

    def late(self) -> None:
        """Record an answer that arrived after the time limit."""
        self._slowest_s = min(self._most_s, max(self._slowest_s, self.wait_s))
