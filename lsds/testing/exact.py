"""Values as exact, comparable copies: arrays by type, shape and content."""

from __future__ import annotations

import dataclasses
import hashlib
from enum import Enum
from typing import Any

import numpy as np

_SHOWN_CHARACTERS = 160
"""Maximum length of a value in a message, characters; chosen."""


def exact(value: Any) -> Any:
    """Return an exact copy of a value made of tuples, texts; NaN equals NaN."""
    if isinstance(value, np.ndarray):
        return ("array", str(value.dtype), value.shape, hashlib.blake2b(value.tobytes()).hexdigest())
    if isinstance(value, BaseException):
        return ("raised", type(value).__name__, str(value))
    if isinstance(value, Enum):
        return value.name
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return (
            type(value).__name__,
            *((field.name, exact(getattr(value, field.name))) for field in dataclasses.fields(value)),
        )
    if isinstance(value, dict):
        return ("dict", *((str(key), exact(part)) for key, part in value.items()))
    if isinstance(value, list | tuple):
        return (type(value).__name__, *map(exact, value))
    if value is None or isinstance(value, bool | int | float | str | np.generic):
        return f"{type(value).__name__} {value!r}"
    return type(value).__name__


def form(value: Any) -> Any:
    """Return the types of a value and its parts, with the type and shape of its arrays, without their content."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype} array of shape {value.shape}"
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        parts = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
        arrays = {name: form(part) for name, part in parts.items() if isinstance(part, np.ndarray)}
        return (type(value).__name__, *arrays.items()) if arrays else type(value).__name__
    return type(value).__name__


def arrays_of(value: Any, path: str = "") -> dict[str, Any]:
    """Return every array in a value of dataclasses, dicts and tuples, by its name."""
    if isinstance(value, np.ndarray):
        return {path: value}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        parts = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    elif isinstance(value, dict):
        parts = {str(key): part for key, part in value.items()}
    elif isinstance(value, list | tuple):
        parts = {str(i): part for i, part in enumerate(value)}
    else:
        return {}
    return {
        found: array
        for name, part in parts.items()
        for found, array in arrays_of(part, f"{path}.{name}".lstrip(".")).items()
    }


def shown(copy: Any) -> str:
    """Return an exact copy as a short text; arrays without their content."""
    if isinstance(copy, tuple) and len(copy) == 4 and copy[0] == "array":
        return f"{copy[1]} array {copy[2]}"
    if isinstance(copy, tuple) and copy and copy[0] == "raised":
        return f"{copy[1]}: {copy[2]}"
    text = f"({', '.join(map(shown, copy))})" if isinstance(copy, tuple) else str(copy)
    return text if len(text) <= _SHOWN_CHARACTERS else f"{text[:_SHOWN_CHARACTERS]}..."
