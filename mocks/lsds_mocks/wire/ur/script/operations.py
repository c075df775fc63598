"""Operations on values: operators, elements, copies, texts. Sizes are limited, and their price depends on the size.

Integers have 32 bits, like the controller's variables (Universal Robots, user manual, "Variables"), and wrap around
like its registers. Lists, texts and their nesting depth have limits.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from lsds_mocks.wire.ur.script.errors import ScriptError
from lsds_mocks.wire.ur.script.values import Pose, Struct, UrList
from lsds_mocks.wire.ur.script.work import Work

MOST_ELEMENTS = 65_536
"""Maximum number of elements of a list, and of characters of a text."""

DEEPEST = 16
"""Lists in lists."""

_LOWEST = -(2**31)
"""Smallest integer of URScript, of 32 bits."""
_HIGHEST = 2**31 - 1
"""Largest integer of URScript, of 32 bits."""
_NUMBERS = frozenset((int, float, bool))
_LIST = 30
"""Price of a list, units of work; chosen."""
_ELEMENT = 8
"""Price of an element that is calculated, units of work; chosen."""
_COPIED = 2
"""Price of an element that is copied, units of work; chosen."""
_SHOWN_PRICE = 20
"""Price of an element that is converted to text, units of work; chosen."""
_CHARACTERS = 16
"""Number of characters of text per unit of work; chosen."""


def wrapped(number: int) -> int:
    """Return an integer as its lowest 32 bits, signed."""
    return number if _LOWEST <= number <= _HIGHEST else (number + 2**31) % 2**32 - 2**31


def whole(number: float) -> int:
    """Return a whole number as an integer. Raises ScriptError if it does not fit into 32 bits."""
    if not _LOWEST <= number <= _HIGHEST:
        raise ScriptError(f"value_error: {number:g} does not fit into an integer of 32 bits")
    return int(number)


class Operations:
    """Bound to one budget of work."""

    def __init__(self, work: Work) -> None:
        self._spend = work.spend

    # -- operators ----------------------------------------------------------------------------------------

    def add(self, a: Any, b: Any) -> Any:
        """`a + b`: numbers, lists element by element, texts."""
        if type(a) in _NUMBERS and type(b) in _NUMBERS:
            c = a + b
            return c if type(c) is float else wrapped(c)
        if type(a) is str and type(b) is str:
            return self.checked(a + b)
        return self._each(self.add, "+", a, b)

    def sub(self, a: Any, b: Any) -> Any:
        """`a - b`: numbers, or lists element by element."""
        if type(a) in _NUMBERS and type(b) in _NUMBERS:
            c = a - b
            return c if type(c) is float else wrapped(c)
        return self._each(self.sub, "-", a, b)

    def mul(self, a: Any, b: Any) -> Any:
        """`a * b`: numbers, or lists element by element."""
        if type(a) in _NUMBERS and type(b) in _NUMBERS:
            c = a * b
            return c if type(c) is float else wrapped(c)
        return self._each(self.mul, "*", a, b)

    def div(self, a: Any, b: Any) -> Any:
        """`a / b`: numbers, or lists element by element."""
        if type(a) in _NUMBERS and type(b) in _NUMBERS:
            return a / b
        return self._each(self.div, "/", a, b)

    def mod(self, a: Any, b: Any) -> Any:
        """`a % b` of numbers."""
        if type(a) in _NUMBERS and type(b) in _NUMBERS:
            return a % b
        raise _no_way("%", a, b)

    def neg(self, a: Any) -> Any:
        """`-a`: a number, or a list element by element."""
        if type(a) in _NUMBERS:
            c = -a
            return c if type(c) is float else wrapped(c)
        return self._each(self.mul, "-", -1, a)

    def eq(self, a: Any, b: Any) -> bool:
        """`a == b`."""
        if isinstance(a, list) and isinstance(b, list):
            self._spend(_ELEMENT * len(a))
            return len(a) == len(b) and all(map(self.eq, a, b))
        if isinstance(a, Struct) and isinstance(b, Struct):
            self._spend(_ELEMENT * len(a))
            return a.keys() == b.keys() and all(self.eq(a[key], b[key]) for key in a)
        return bool(a == b)

    def ne(self, a: Any, b: Any) -> bool:
        """`a != b`."""
        return not self.eq(a, b)

    def lt(self, a: Any, b: Any) -> bool:
        """`a < b`: numbers, or texts."""
        _require_order("<", a, b)
        return bool(a < b)

    def le(self, a: Any, b: Any) -> bool:
        """`a <= b`: numbers, or texts."""
        _require_order("<=", a, b)
        return bool(a <= b)

    def gt(self, a: Any, b: Any) -> bool:
        """`a > b`: numbers, or texts."""
        return self.lt(b, a)

    def ge(self, a: Any, b: Any) -> bool:
        """`a >= b`: numbers, or texts."""
        return self.le(b, a)

    def _each(self, of: Callable[[Any, Any], Any], operator: str, a: Any, b: Any) -> Any:
        if isinstance(a, UrList) and isinstance(b, UrList):
            if len(a) != len(b):
                raise ScriptError(f"type_error: lists of {len(a)} and {len(b)} elements do not go together")
            self._spend(_ELEMENT * len(a))
            return type(a)(map(of, a, b))
        if isinstance(a, UrList) and type(b) in _NUMBERS:
            self._spend(_ELEMENT * len(a))
            return type(a)([of(item, b) for item in a])
        if type(a) in _NUMBERS and isinstance(b, UrList):
            self._spend(_ELEMENT * len(b))
            return type(b)([of(a, item) for item in b])
        raise _no_way(operator, a, b)

    # -- elements and fields ------------------------------------------------------------------------------

    def at(self, base: Any, index: Any) -> Any:
        """`base[index]`."""
        if not isinstance(base, UrList) and type(base) is not str:
            raise ScriptError(f"type_error: {_kind(base)} has no elements")
        return base[_place(base, index)]

    def put(self, base: Any, index: Any, value: Any) -> None:
        """`base[index] = value`."""
        if not isinstance(base, UrList):
            raise ScriptError(f"type_error: {_kind(base)} has no elements to be changed")
        base[_place(base, index)] = value

    def field(self, base: Any, name: str) -> Any:
        """`base.name`."""
        if not isinstance(base, Struct) or name not in base:
            raise ScriptError(f"type_error: {_kind(base)} has no field {name}")
        return base[name]

    def put_field(self, base: Any, name: str, value: Any) -> None:
        """`base.name = value`."""
        if not isinstance(base, Struct):
            raise ScriptError(f"type_error: {_kind(base)} has no fields")
        base[name] = value

    def method(self, value: Any, name: str, *arguments: Any) -> Any:
        """Call a method of a list; return its result."""
        if not isinstance(value, UrList) or name not in _METHODS:
            raise ScriptError(f"compile_error_name_not_found:{name}:")
        if len(arguments) != _METHODS[name]:
            raise ScriptError(f"type_error: {name} takes {_METHODS[name]} arguments, not {len(arguments)}")
        if name == "length":
            return len(value)
        if name == "append":
            self._require_room(value, name)
            return value.append(self.copied(arguments[0]))
        self._spend(1 + len(value) // 4)
        if name == "pop":
            return value.pop()
        if name == "clear":
            return value.clear()
        if name == "insert":
            self._require_room(value, name)
            return value.insert(_place(value, arguments[0], len(value) + 1), self.copied(arguments[1]))
        if name == "remove":
            del value[_place(value, arguments[0])]
            return None
        first = _place(value, arguments[0], len(value) + 1)
        return self.copied(type(value)(value[first : max(first, int(arguments[1]))]))

    def _require_room(self, value: UrList, name: str) -> None:
        if len(value) >= MOST_ELEMENTS:
            raise ScriptError(f"{name}: a list has at most {MOST_ELEMENTS} elements")

    # -- copies, limits, texts ----------------------------------------------------------------------------

    def copied(self, value: Any, depth: int = 0) -> Any:
        """Return a value that a name may be bound to: lists and structs as deep copies."""
        if isinstance(value, UrList):
            self._descend(value, _COPIED, depth)
            return type(value)([self.copied(item, depth + 1) if type(item) in _COMPOUND else item for item in value])
        if isinstance(value, Struct):
            self._descend(value, _COPIED, depth)
            return Struct({key: self.copied(item, depth + 1) for key, item in value.items()})
        return value

    def checked(self, value: Any) -> Any:
        """Return a function's result unchanged. Raises ScriptError if a variable cannot hold it."""
        if type(value) is int:
            return wrapped(value)
        if type(value) is str:
            if len(value) > MOST_ELEMENTS:
                raise ScriptError(f"value_error: a text has at most {MOST_ELEMENTS} characters")
            self._spend(1 + len(value) // _CHARACTERS)
        elif isinstance(value, list):
            if len(value) > MOST_ELEMENTS:
                raise ScriptError(f"value_error: a list has at most {MOST_ELEMENTS} elements")
            self._spend(_COPIED * len(value))
        elif isinstance(value, complex):
            raise ScriptError("value_error: the result is no real number")
        return value

    def text(self, value: Any, depth: int = 0) -> str:
        """Return a value as the controller prints it."""
        if isinstance(value, str):
            return str(self.checked(value))
        if isinstance(value, float):
            return f"{value:.6g}" if not math.isfinite(value) or value % 1 or abs(value) >= 1e15 else f"{value:.0f}"
        if isinstance(value, UrList):
            self._descend(value, _SHOWN_PRICE, depth)
            inside = ", ".join([self.text(item, depth + 1) for item in value])
            return str(self.checked(f"{'p' if isinstance(value, Pose) else ''}[{inside}]"))
        if isinstance(value, Struct):
            self._descend(value, _SHOWN_PRICE, depth)
            inside = ", ".join([f"{key}={self.text(item, depth + 1)}" for key, item in value.items()])
            return str(self.checked(f"struct({inside})"))
        return str(value)

    def _descend(self, value: UrList | Struct, price: int, depth: int) -> None:
        if depth >= DEEPEST:
            raise ScriptError(f"value_error: lists are nested deeper than {DEEPEST}")
        self._spend(_LIST + price * len(value))


_COMPOUND = frozenset((UrList, Pose, Struct))
_METHODS = {"length": 0, "append": 1, "pop": 0, "clear": 0, "insert": 2, "remove": 1, "slice": 2}
"""Methods of a list, with the number of their arguments."""


def _place(value: UrList | str, index: Any, count: int | None = None) -> int:
    number = int(index)
    count = len(value) if count is None else count
    if not 0 <= number < count:
        raise ScriptError(f"runtime_error: index {wrapped(number)} is out of range: 0 to {count - 1}")
    return number


def _require_order(operator: str, a: Any, b: Any) -> None:
    if not (type(a) in _NUMBERS and type(b) in _NUMBERS) and not (type(a) is str and type(b) is str):
        raise _no_way(operator, a, b)


def _no_way(operator: str, a: Any, b: Any) -> ScriptError:
    return ScriptError(f"type_error: {_kind(a)} {operator} {_kind(b)} cannot be calculated")


def _kind(value: Any) -> str:
    names = {int: "int", float: "float", bool: "bool", str: "string", Pose: "pose", UrList: "list", Struct: "struct"}
    return names.get(type(value), "none")
