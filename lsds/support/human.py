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
    return MISSING if value_m is None or math.isnan(value_m) else f"{number(1e3 * value_m)} mm"


def speed(value_m_s: float | None) -> str:
    """Return a speed (m/s) in mm/s."""
    return MISSING if value_m_s is None or math.isnan(value_m_s) else f"{number(1e3 * value_m_s)} mm/s"


def force(value_n: float | None) -> str:
    """Return a force (N)."""
    return MISSING if value_n is None or math.isnan(value_n) else f"{number(value_n)} N"


def duration(value_s: float | None) -> str:
    """Return a duration (s) in s, or in ms if it is below one second."""
    if value_s is None or math.isnan(value_s):
        return MISSING
    return f"{number(value_s)} s" if abs(value_s) >= 1 else f"{number(1e3 * value_s)} ms"
