"""Quantities as people read them: three digits, no exponent, and the unit that keeps the number short."""

from __future__ import annotations

import math

MISSING = "-"
"""Text of a value that was not measured."""
QUANTITY_DIGITS = 3
"""Significant digits of a quantity."""


def number(value: float) -> str:
    """Return a number with three significant digits and without an exponent; at most three decimals."""
    if not math.isfinite(value):
        return MISSING
    if value == 0:
        return "0"
    magnitude = math.floor(math.log10(abs(value)))
    rounded = round(value, QUANTITY_DIGITS - 1 - magnitude)
    decimals = min(max(QUANTITY_DIGITS - 1 - magnitude, 0), QUANTITY_DIGITS)
    text = f"{rounded:.{decimals}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text == "-0" else text


def length(value_m: float | None) -> str:
    """Return a length (m) in mm."""
    return _quantity(value_m, 1e3, "mm")


def speed(value_m_s: float | None) -> str:
    """Return a speed (m/s) in mm/s."""
    return _quantity(value_m_s, 1e3, "mm/s")


def force(value_n: float | None) -> str:
    """Return a force (N)."""
    return _quantity(value_n, 1.0, "N")


def duration(value_s: float | None) -> str:
    """Return a duration (s) in s, or in ms if it is below one second."""
    in_seconds = value_s is not None and abs(value_s) >= 1
    return _quantity(value_s, 1.0, "s") if in_seconds else _quantity(value_s, 1e3, "ms")


def _quantity(value: float | None, factor: float, unit: str) -> str:
    return MISSING if value is None or math.isnan(value) else f"{number(factor * value)} {unit}"
