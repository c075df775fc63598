"""Durations as people write them: 90s, 10min, 2h."""

from __future__ import annotations

import re

from lsds.errors import DataError

_UNITS_S = {"s": 1.0, "min": 60.0, "h": 3600.0}
GREATEST_BUDGET_S = 1000 * 3600.0
"""Longest budget, s; chosen."""
_DURATION = re.compile(r"\s*(\d+(?:\.\d+)?)\s*(s|min|h)\s*")


def seconds_of(text: str, name: str) -> float:
    """Return a duration in seconds. Raises DataError with the option's name for any other text."""
    match = _DURATION.fullmatch(text)
    seconds = 0.0 if match is None else float(match[1]) * _UNITS_S[match[2]]
    if not 0 < seconds <= GREATEST_BUDGET_S:
        raise DataError(
            f"{name} {text[:40]!r} is no duration up to {GREATEST_BUDGET_S / 3600:g}h; write 90s, 10min or 2h"
        )
    return seconds
