"""Messages as rows: nested objects become columns `outer.inner`, arrays become lists."""

from __future__ import annotations

import math
from typing import Any

from lsds.models.signals import UNITS

SUFFIXES = (
    ("_m_s2", "m/s2"),
    ("_rad_s", "rad/s"),
    ("_m_s", "m/s"),
    ("_n_s", "N/s"),
    ("_nm", "N m"),
    ("_px", "px"),
    ("_ns", "ns"),
    ("_rad", "rad"),
    ("_m", "m"),
    ("_n", "N"),
    ("_s", "s"),
)
"""Ends of field names and their SI units (px for places in an image), longest first."""
METRES = ("joints.position", "pose.position.x", "pose.position.y", "pose.position.z")
"""Columns of the viewers' types that are lengths; their field names hold no unit."""


def flattened(value: Any, prefix: str = "") -> dict[str, Any]:
    """Return the columns of a message by name. A list of objects gives one list per field."""
    if isinstance(value, dict):
        found: dict[str, Any] = {}
        for name, each in value.items():
            found |= flattened(each, f"{prefix}.{name}" if prefix else name)
        return found
    if isinstance(value, list) and value and all(isinstance(each, dict) for each in value):
        rows = [flattened(each, prefix) for each in value]
        names = dict.fromkeys(name for row in rows for name in row)
        return {name: [row.get(name) for row in rows] for name in names}
    return {prefix or "value": value}


def unit_of(column: str) -> str:
    """Return the unit of a column; "" for one that has none, or whose unit the recording does not state."""
    if column in METRES:
        return "m"
    name = column.rsplit(".", 1)[-1]
    if name in UNITS:
        return UNITS[name]
    return next((unit for end, unit in SUFFIXES if name.endswith(end)), "")


def without_text(value: Any) -> Any:
    """Return numbers as numbers: infinities are text in JSON. Apply it to columns of numbers."""
    if isinstance(value, list):
        return [without_text(each) for each in value]
    return math.inf if value == "inf" else -math.inf if value == "-inf" else value
