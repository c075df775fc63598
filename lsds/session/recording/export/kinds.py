"""The type of a column: what the schema of its topic declares, and else what its values are.

A kind is "null", "bool", "int64", "double", "infinite" (the text of an infinite number), "string", "binary", or
("list", kind). The declared kinds come first, so that a column has one type in all recordings, also in one in which it
holds nothing.
"""

from __future__ import annotations

import json
from typing import Any

Kind = str | tuple[str, Any]

JSON_KINDS = {"boolean": "bool", "integer": "int64", "number": "double", "string": "string"}
INFINITE = ("inf", "-inf")


def declared(schema: bytes) -> dict[str, Kind]:
    """Return the kinds of the columns that a JSON schema names; none for the schema of another encoding."""
    try:
        parsed = json.loads(schema)
    except ValueError:
        return {}
    return {name: kind for name, kind in _declared(parsed, "").items() if name and not _is_empty(kind)}


def kind_of(value: Any) -> Kind:
    """Return the kind of one value of a column."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "bool"
    if isinstance(value, list):
        kind: Kind = "null"
        for each in value:
            kind = merged(kind, kind_of(each))
        return ("list", kind)
    if isinstance(value, str):
        return "infinite" if value in INFINITE else "string"
    return {int: "int64", float: "double", bytes: "binary"}[type(value)]


def merged(one: Kind, other: Kind) -> Kind:
    """Return the kind that holds the values of both; text for kinds that have nothing in common."""
    if one == other or other == "null":
        return one
    if one == "null":
        return other
    if isinstance(one, tuple) and isinstance(other, tuple):
        return ("list", merged(one[1], other[1]))
    if {one, other} <= {"int64", "double", "infinite"}:
        return "double"
    return "string"


class Columns:
    """The columns of one topic, by what was seen of them so far."""

    def __init__(self, schema: bytes) -> None:
        self._declared = declared(schema)
        self._seen: dict[str, Kind] = {}

    def see(self, row: dict[str, Any]) -> None:
        """Take in a row."""
        for name, value in row.items():
            if name not in self._declared:
                self._seen[name] = merged(self._seen.get(name, "null"), kind_of(value))

    def kinds(self) -> dict[str, Kind]:
        """Return the columns. One that holds only nothing is a number, which is unknown in every row."""
        found = {name: _settled(kind) for name, kind in (self._declared | self._seen).items()}
        # An object that is absent is null under its own name; its fields have the columns.
        empty = {name for name, kind in self._seen.items() if _is_empty(kind)}
        return {
            name: kind
            for name, kind in found.items()
            if name not in empty or not any(other.startswith(f"{name}.") for other in found)
        }


def _is_empty(kind: Kind) -> bool:
    return kind == "null" or (isinstance(kind, tuple) and _is_empty(kind[1]))


def _settled(kind: Kind) -> Kind:
    if isinstance(kind, tuple):
        return ("list", _settled(kind[1]))
    return {"null": "double", "infinite": "string"}.get(kind, kind)


def _declared(schema: Any, prefix: str) -> dict[str, Kind]:
    if "anyOf" in schema:
        others = [each for each in schema["anyOf"] if each.get("type") != "null"]
        return _declared(others[0], prefix) if len(others) == 1 else {}
    if "properties" in schema:
        found: dict[str, Kind] = {}
        for name, each in schema["properties"].items():
            found |= _declared(each, f"{prefix}.{name}" if prefix else name)
        return found
    if schema.get("type") == "array":
        return {name: ("list", kind) for name, kind in _declared(schema.get("items", {}), prefix).items()}
    if "enum" in schema:
        return {prefix: "string"} if all(isinstance(each, str) for each in schema["enum"]) else {}
    kinds = schema.get("type")
    first = kinds[0] if isinstance(kinds, list) else kinds
    return {prefix: JSON_KINDS[first]} if first in JSON_KINDS else {}
