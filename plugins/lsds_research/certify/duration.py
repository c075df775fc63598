"""Durations as people write them: 90s, 10min, 2h."""

from __future__ import annotations

import re

from lsds.errors import DataError

_UNITS_S = {"s": 1.0, "min": 60.0, "h": 3600.0}
_DURATION = re.compile(r"\s*(\d+(?:\.\d+)?)\s*(s|min|h)\s*")


def seconds_of(text: str, name: str) -> float:
    """Return a duration in seconds. Raises DataError with the option's name for any other text."""
    match = _DURATION.fullmatch(text)
    if match is None or float(match[1]) <= 0:
        raise DataError(f"{name} {text!r} is no duration; write 90s, 10min or 2h")
    return float(match[1]) * _UNITS_S[match[2]]
