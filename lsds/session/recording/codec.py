"""Values of the contracts as JSON and back, and the JSON schemas of their types.

Numbers round-trip exactly: Python writes the shortest text that reads back as the same double. NaN is null, because
viewers refuse NaN; in `to_json` infinities are the strings "inf" and "-inf".
"""

from __future__ import annotations

import math
import types
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

from lsds.contracts import job, values
from lsds.errors import DataError

_INFINITE = {"inf": math.inf, "-inf": -math.inf}


def to_json(value: Any) -> Any:
    """Return a value of the contracts as JSON: dataclasses, named tuples, enumerations, arrays, numbers, text."""
    if isinstance(value, bool | str | int | None):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else _special(value)
    if isinstance(value, np.ndarray):
        return _listed(value)
    if isinstance(value, np.generic):
        return to_json(value.item())
    if isinstance(value, Enum):
        return value.value
    if is_dataclass(value) and not isinstance(value, type):
        return {name: to_json(getattr(value, name)) for name in _names(type(value))}
    if isinstance(value, dict):
        return {str(key): to_json(each) for key, each in value.items()}
    if isinstance(value, tuple) and (names := getattr(value, "_fields", None)) is not None:
        return {name: to_json(each) for name, each in zip(names, value, strict=True)}
    if isinstance(value, list | tuple):
        return [to_json(each) for each in value]
    raise TypeError(f"{type(value).__name__} has no form in a recording")


def to_text(value: Any) -> bytes:
    """Return a value as JSON text, as `to_json` but for infinities, which become null as well."""
    import orjson

    return orjson.dumps(value, default=_slow, option=orjson.OPT_SERIALIZE_NUMPY)


def _slow(value: Any) -> Any:
    """Return what the fast encoder does not know: arrays in another order of memory, named tuples."""
    return to_json(value)


def from_json(kind: Any, value: Any, where: str) -> Any:
    """Return JSON as a value of a type. Raises DataError, naming `where`, for JSON of another form."""
    try:
        return _read(kind, value)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise DataError(f"{where}: not a {getattr(kind, '__name__', kind)}: {error!r}") from error


def schema_of(kind: Any) -> dict[str, Any]:
    """Return the JSON schema of a type of the contracts."""
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        return {"anyOf": [schema_of(each) for each in arguments]}
    if kind is type(None):
        return {"type": "null"}
    if kind is float:
        return {"type": ["number", "null", "string"]}
    if kind in (bool, int, str):
        return {"type": {bool: "boolean", int: "integer", str: "string"}[kind]}
    if origin is Literal:
        return {"enum": list(arguments)}
    if origin is dict:
        return {"type": "object", "additionalProperties": schema_of(arguments[1])}
    if origin in (tuple, list):
        return {"type": "array", "items": schema_of(arguments[0]) if arguments else {}}
    if isinstance(kind, type) and issubclass(kind, Enum):
        return {"enum": [each.value for each in kind]}
    if isinstance(kind, type) and is_dataclass(kind):
        hints = _hints(kind)
        return {
            "type": "object",
            "title": kind.__name__,
            "properties": {name: schema_of(hints[name]) for name in _names(kind)},
        }
    return {}


def _special(value: float) -> str | None:
    return None if math.isnan(value) else "inf" if value > 0 else "-inf"


def _listed(array: np.ndarray[Any, Any]) -> list[Any]:
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        return [to_json(each) for each in array.tolist()]
    found: list[Any] = array.tolist()
    return found


@cache
def _names(kind: type) -> tuple[str, ...]:
    """Return the fields of a dataclass that a recording holds: all but functions."""
    return tuple(field.name for field in fields(kind) if not callable(field.default))


@cache
def _hints(kind: type) -> dict[str, Any]:
    # Contracts import each other for type checkers only.
    return get_type_hints(kind, localns=vars(values) | vars(job))


def _read(kind: Any, value: Any) -> Any:
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):
        if value is None and type(None) in arguments:
            return None
        return _read(next(each for each in arguments if each is not type(None)), value)
    if kind is float:
        return math.nan if value is None else _INFINITE[value] if isinstance(value, str) else float(value)
    if kind in (bool, int, str):
        if type(value) is not kind:
            raise TypeError(f"{value!r} is not {kind.__name__}")
        return value
    if origin is tuple:
        if len(arguments) == 2 and arguments[1] is ...:
            return tuple(_read(arguments[0], each) for each in value)
        return tuple(_read(each, one) for each, one in zip(arguments, value, strict=True))
    if origin is dict:
        return {key: _read(arguments[1], each) for key, each in value.items()}
    if isinstance(kind, type) and issubclass(kind, Enum):
        return kind(value)
    if isinstance(kind, type) and is_dataclass(kind):
        hints = _hints(kind)
        # A field that the file does not have is newer than the file, and has its default.
        return kind(**{name: _read(hints[name], value[name]) for name in _names(kind) if name in value})
    raise TypeError(f"{kind} cannot be read from a recording")
