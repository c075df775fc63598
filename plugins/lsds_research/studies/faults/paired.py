"""Paired comparisons of binary outcomes: McNemar's exact test, with Holm's correction for many tests."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence


def mcnemar(pairs: Sequence[tuple[bool, bool]]) -> float:
    """Return the two-sided p value of equal rates in both members of pairs (McNemar 1947, exact)."""
    first = sum(a and not b for a, b in pairs)
    differ = sum(a != b for a, b in pairs)
    tail = sum(math.comb(differ, k) for k in range(min(first, differ - first) + 1))
    return min(1.0, float(2 * tail / 2**differ))


def holm(values: Mapping[str, float]) -> dict[str, float]:
    """Return p values corrected for their number (Holm 1979)."""
    corrected, least = {}, 0.0
    for rank, (name, value) in enumerate(sorted(values.items(), key=lambda item: item[1])):
        least = max(least, min(1.0, (len(values) - rank) * value))
        corrected[name] = least
    return corrected
