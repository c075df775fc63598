"""A small TOML writer for configurations: tables, lists, strings, numbers, booleans, dates.

The standard library reads TOML but does not write it, and a dependency would cost more than these few lines.
"""

from __future__ import annotations

import datetime
import json
import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def dumps(data: Mapping[str, Any], comment: Callable[[tuple[str, ...]], str] = lambda _: "") -> str:
    """Return nested mappings as TOML; None is left out.

    `comment` returns the comment of a key, by its path; a None value with a comment is written as a comment line.
    """
    lines: list[str] = []
    _table(data, (), lines, comment)
    return "\n".join(lines).strip() + "\n"


def key_text(key: str) -> str:
    """Return a key, quoted where it has to be."""
    return key if _BARE.fullmatch(key) else _string(key)


def value_text(value: Any) -> str:
    """Return a value as TOML, a path as text. Raises TypeError for what TOML cannot hold."""
    if isinstance(value, Path):
        value = str(value)
    elif hasattr(value, "dtype") and hasattr(value, "item"):
        value = value.item()  # NumPy's numbers are not Python's, or print otherwise.
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return _float(value)
    if isinstance(value, str):
        return _string(value)
    if isinstance(value, datetime.datetime | datetime.date | datetime.time):
        return value.isoformat()
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(value_text, value)) + "]"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key_text(k)} = {value_text(v)}" for k, v in value.items() if v is not None) + "}"
    raise TypeError(f"TOML cannot hold a {type(value).__name__}")


def _table(
    data: Mapping[str, Any], path: tuple[str, ...], lines: list[str], comment: Callable[[tuple[str, ...]], str]
) -> None:
    inner = {key: value for key, value in data.items() if isinstance(value, Mapping)}
    plain = {key: value for key, value in data.items() if key not in inner}
    if path and (any(value is not None for value in plain.values()) or not inner):
        lines.append("")
        if note := comment(path):
            lines.append(f"# {note}")
        lines.append(f"[{'.'.join(map(key_text, path))}]")
    for key, value in plain.items():
        note = comment((*path, key))
        if value is not None:
            lines.append(f"{key_text(key)} = {value_text(value)}" + (f"  # {note}" if note else ""))
        elif note:
            lines.append(f"# {key_text(key)} =  # {note}; not set")
    for key, value in inner.items():
        _table(value, (*path, key), lines, comment)


def _float(value: float) -> str:
    if math.isnan(value):
        return "nan"
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return repr(value)


def _string(text: str) -> str:
    # JSON's escapes are a subset of TOML's, except DEL, which TOML wants escaped, and surrogates, which it forbids.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
