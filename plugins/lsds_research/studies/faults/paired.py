"""Paired comparisons: the exact sign test and McNemar's, with Holm's correction for many tests."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence


def sign_test(differences: Sequence[int]) -> float:
    """Return the two-sided p value of differences that are as often positive as negative (exact); ties do not count.

    The differences must be independent: one per gel if runs share gels.
    """
    first = sum(value > 0 for value in differences)
    differ = sum(value != 0 for value in differences)
    tail = sum(math.comb(differ, k) for k in range(min(first, differ - first) + 1))
    return min(1.0, float(2 * tail / 2**differ))


def mcnemar(pairs: Sequence[tuple[bool, bool]]) -> float:
    """Return the two-sided p value of equal rates in both members of independent pairs (McNemar 1947, exact)."""
    return sign_test([a - b for a, b in pairs])


def holm(values: Mapping[str, float]) -> dict[str, float]:
    """Return p values corrected for their number (Holm 1979)."""
    corrected, least = {}, 0.0
    for rank, (name, value) in enumerate(sorted(values.items(), key=lambda item: item[1])):
        least = max(least, min(1.0, (len(values) - rank) * value))
        corrected[name] = least
    return corrected
