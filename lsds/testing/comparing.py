"""Answers as plain values, copied when they are given, so that they can be compared later."""

from __future__ import annotations

import dataclasses
import math
from enum import Enum
from typing import Any

import numpy as np

RELATIVE = 1e-6
"""Relative difference below which numbers are equal: threads may add in another order."""
ABSOLUTE = 1e-12
"""Absolute difference below which numbers are equal, for those near zero."""


def plain(answer: Any) -> Any:
    """Return a copy of an answer made of tuples, numbers and texts."""
    if dataclasses.is_dataclass(answer) and not isinstance(answer, type):
        parts = ((field.name, plain(getattr(answer, field.name))) for field in dataclasses.fields(answer))
        return (type(answer).__name__, *parts)
    if isinstance(answer, np.ndarray):
        return ("array", str(answer.dtype), answer.shape, *(plain(number) for number in answer.ravel().tolist()))
    if isinstance(answer, Enum):
        return answer.name
    if isinstance(answer, np.generic):
        return answer.item()
    if isinstance(answer, list | tuple):
        return tuple(map(plain, answer))
    if answer is None or isinstance(answer, bool | int | float | str):
        return answer
    return type(answer).__name__


def alike(one: Any, other: Any) -> bool:
    """Return whether two plain values are equal; NaN equals NaN."""
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(alike, one, other))
    if isinstance(one, float) and isinstance(other, float):
        both_nan = math.isnan(one) and math.isnan(other)
        return both_nan or one == other or math.isclose(one, other, rel_tol=RELATIVE, abs_tol=ABSOLUTE)
    return type(one) is type(other) and bool(one == other)


def first_difference(ones: list[Any], others: list[Any]) -> str:
    """Return the first difference between two lists of plain answers, "" for equal ones."""
    for i, (one, other) in enumerate(zip(ones, others, strict=False)):
        if not alike(one, other):
            return f"input {i}: {_short(one)} against {_short(other)}"
    if len(ones) != len(others):
        return f"{len(ones)} answers against {len(others)}"
    return ""


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 300 else f"{text[:300]}..."
