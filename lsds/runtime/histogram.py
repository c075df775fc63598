"""A logarithmic histogram of durations: constant memory, any range, quantiles to 1.6 %."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

#: Bits of a value that a bin resolves after the leading one: bins are at most 1/32 of their value wide.
_SUB_BITS = 5
_SUB = 1 << _SUB_BITS
_MAX_BITS = 60
"""Durations up to 2^60 ns, which is 36 years."""


class LogHistogram:
    """Counts of non-negative integers in bins whose width is at most 1/32 of their value.

    A bin is found from the leading bits of a value, as in HdrHistogram: no logarithm is taken. Reporting a bin's
    middle keeps the relative error of a quantile within 1/64; values below 64 are exact.
    """

    __slots__ = ("_counts", "count", "maximum", "total")

    def __init__(self) -> None:
        self._counts = [0] * ((_MAX_BITS - _SUB_BITS + 1) * _SUB)
        self.count = 0
        self.total = 0
        self.maximum = 0

    def add(self, values: Iterable[int]) -> None:
        """Count values. Counting equal ones first makes a batch cheap."""
        counts = self._counts
        for value, times in Counter(values).items():
            value = max(value, 0)
            shift = max(value.bit_length() - _SUB_BITS - 1, 0)
            counts[min(shift * _SUB + (value >> shift), len(counts) - 1)] += times
            self.count += times
            self.total += value * times
            if value > self.maximum:
                self.maximum = value

    @property
    def mean(self) -> float:
        """The exact mean; 0 where nothing was counted."""
        return self.total / self.count if self.count else 0.0

    def quantile(self, q: float) -> float:
        """Return the value below which a fraction `q` in [0, 1] lies; 0 where nothing was counted."""
        wanted = q * self.count
        seen = 0
        for index, times in enumerate(self._counts):
            seen += times
            if times and seen >= wanted:
                return min(_middle(index), float(self.maximum))
        return 0.0


def _middle(index: int) -> float:
    shift = max(index // _SUB - 1, 0)
    low = (index - shift * _SUB) << shift
    return low + ((1 << shift) - 1) / 2
