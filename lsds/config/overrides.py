"""`--set a.b.c=value`: one key of the configuration, from the command line."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Any

from lsds.config.toml import value_text
from lsds.errors import ConfigIssue

_EXAMPLE = "write --set gripper.backend=hand-e"


def parse_override(text: str) -> tuple[tuple[str, ...], Any] | ConfigIssue:
    """Return the path and the value of `a.b.c=value`, or the issue found in it.

    The value is read as TOML. A text that is not TOML, and does not begin like a quoted string, list or table, is taken
    as a string.
    """
    key, equals, value = text.partition("=")
    where = f"--set {text}"
    if not equals:
        return ConfigIssue(where, "has no '='", _EXAMPLE)
    path = _parse_key(key.strip())
    if path is None:
        return ConfigIssue(where, f"'{key.strip()}' is not a dotted key", _EXAMPLE)
    value = value.strip()
    if not value:
        return ConfigIssue(where, "has no value", 'write key="" for an empty string')
    try:
        return path, parse_value(value)
    except tomllib.TOMLDecodeError as error:
        return ConfigIssue(where, f"the value is not TOML: {error}", "check quotes and brackets")


def parse_value(text: str) -> Any:
    """Return a value typed on a command line: as TOML, or else as a string.

    Raises tomllib.TOMLDecodeError if it begins like a quoted string, list or table but is not valid TOML.
    """
    try:
        parsed = tomllib.loads(f"v = {text}")
    except tomllib.TOMLDecodeError:
        if text[:1] and text[0] in "\"'[{":
            raise
        return text
    # A value with a line break could define further keys, so it is taken as a string.
    return parsed["v"] if set(parsed) == {"v"} else text


def override_texts(keys: Mapping[str, Any]) -> list[str]:
    """Return the overrides that set dotted keys to values. Raises TypeError for what TOML cannot hold, with the key."""
    texts = []
    for key, value in keys.items():
        try:
            texts.append(f"{key}={value_text(value)}")
        except TypeError as error:
            raise TypeError(f"{key} = {value!r}: {error}") from error
    return texts


def apply_overrides(data: dict[str, Any], overrides: tuple[str, ...]) -> list[ConfigIssue]:
    """Write each override into `data`, in order; return the issues found."""
    issues = []
    for text in overrides:
        parsed = parse_override(text)
        if isinstance(parsed, ConfigIssue):
            issues.append(parsed)
            continue
        path, value = parsed
        table = data
        for depth, part in enumerate(path[:-1]):
            inner = table.setdefault(part, {})
            if not isinstance(inner, dict):
                issues.append(ConfigIssue(f"--set {text}", f"'{'.'.join(path[: depth + 1])}' is not a table"))
                break
            table = inner
        else:
            table[path[-1]] = value
    return issues


def _parse_key(key: str) -> tuple[str, ...] | None:
    if "\n" in key or "#" in key:
        return None
    try:
        nested: Any = tomllib.loads(f"{key} = 0")
    except tomllib.TOMLDecodeError:
        return None
    path = []
    while isinstance(nested, dict):
        if len(nested) != 1:
            return None
        ((part, nested),) = nested.items()
        path.append(part)
    return tuple(path)
