"""Values of the language that Python has not: lists that calculate element by element, and poses.

Numbers, strings and booleans are Python's own. Lists have value semantics: the compiler copies where a name is bound.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Self


class UrList(list[Any]):
    """A list, or a matrix as a list of lists: `+ - * /` go element by element, with a number or a list alike."""

    __slots__ = ()

    def __add__(self, other: Any) -> Self:
        return self._each(other, lambda a, b: a + b)

    def __radd__(self, other: Any) -> Self:
        return self._each(other, lambda a, b: b + a)

    def __sub__(self, other: Any) -> Self:
        return self._each(other, lambda a, b: a - b)

    def __rsub__(self, other: Any) -> Self:
        return self._each(other, lambda a, b: b - a)

    def __mul__(self, other: Any) -> Self:
        return self._each(other, lambda a, b: a * b)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Self:
        return self._each(other, lambda a, b: a / b)

    def __rtruediv__(self, other: Any) -> Self:
        return self._each(other, lambda a, b: b / a)

    def __neg__(self) -> Self:
        return type(self)([-a for a in self])

    def copy(self) -> Self:
        """Return a copy that shares nothing."""
        return type(self)([copied(item) for item in self])

    def _each(self, other: Any, of: Callable[[Any, Any], Any]) -> Self:
        if isinstance(other, list):
            if len(other) != len(self):
                raise TypeError(f"lists of {len(self)} and {len(other)} elements do not go together")
            return type(self)([of(a, b) for a, b in zip(self, other, strict=True)])
        return type(self)([of(a, other) for a in self])


class Pose(UrList):
    """p[x, y, z, rx, ry, rz]: metres, and a rotation vector in radians."""

    __slots__ = ()


class Struct(dict[str, Any]):
    """Named fields, read and written as attributes in a script."""


def copied(value: Any) -> Any:
    """Return a value that a name may be bound to: lists as copies of their own."""
    return value.copy() if isinstance(value, UrList) else value


def to_text(value: Any) -> str:
    """Return a value as the controller prints it."""
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, float):
        return f"{value:.6g}" if value % 1 or abs(value) >= 1e15 else f"{value:.0f}"
    if isinstance(value, Pose):
        return f"p[{', '.join(map(to_text, value))}]"
    if isinstance(value, list):
        return f"[{', '.join(map(to_text, value))}]"
    return str(value)
