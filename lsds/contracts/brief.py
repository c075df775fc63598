"""A short text for values that hold images and arrays: what a notebook shows."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

MOST_SHOWN = 4
"""Greatest length of a tuple that is shown in full."""


def brief(self: Any) -> str:
    """Return a dataclass as text: numbers in six digits, arrays by type and shape, nested values by their type."""
    parts = [f"{field.name}={_short(getattr(self, field.name))}" for field in fields(self) if field.repr]
    return f"{type(self).__name__}({', '.join(part for part in parts if not part.endswith('='))})"


def _short(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    shape = getattr(value, "shape", None)
    if shape is not None and hasattr(value, "dtype"):
        return f"{value.dtype}{list(shape)}"
    if is_dataclass(value):
        return repr(value) if type(value).__repr__ is not brief else f"{type(value).__name__}(...)"
    if isinstance(value, tuple | list) and len(value) > MOST_SHOWN:
        return f"{len(value)} values"
    if isinstance(value, tuple):
        return f"({', '.join(map(_short, value))}{',' if len(value) == 1 else ''})"
    if callable(value):
        return ""
    return repr(value)
