"""Read a TOML file; errors state the line."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from lsds.errors import ConfigError, ConfigIssue

EDITORS_KEY = "$schema"
"""Top-level key of a config that names its schema for an editor; lsds ignores it."""


def read_toml(path: Path) -> dict[str, Any]:
    """Return a TOML file's tables. Raises ConfigError that says where it cannot be read."""
    try:
        raw = path.read_bytes()
    except FileNotFoundError:
        remedy = "check the path, or create a config: lsds config example > rig.toml"
        raise ConfigError(str(path), [ConfigIssue("file", "does not exist", remedy)]) from None
    except IsADirectoryError:
        raise ConfigError(
            str(path), [ConfigIssue("file", "is a directory", "give the name of the .toml file in it")]
        ) from None
    except OSError as error:
        raise ConfigError(str(path), [ConfigIssue("file", f"cannot be read: {error.strerror}")]) from error
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        issue = ConfigIssue(f"line {line}", f"byte 0x{raw[error.start]:02x} is not UTF-8", "save the file as UTF-8")
        raise ConfigError(str(path), [issue]) from None
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(str(path), [_syntax_issue(text, error)]) from None


def line_of(text: str, path: str) -> int | None:
    """Return the number of the line on which the key of a dotted path begins in valid TOML, or None.

    It is a line that names a part of the path, before which the text is valid TOML without the key, and after which the
    next beginning of the text that is valid TOML has it.
    """
    lines, names = text.split("\n"), path.split(".")

    def has(count: int) -> bool | None:
        """Return whether the first lines have the key, None if they are no valid TOML: a value goes on."""
        try:
            return value_at(tomllib.loads("\n".join(lines[:count]) + "\n"), path) is not None
        except tomllib.TOMLDecodeError:
            return None

    for number, line in enumerate(lines):
        if any(name in line for name in names) and has(number) is False:
            later = (has(count) for count in range(number + 1, len(lines) + 1))
            if next((found for found in later if found is not None), False):
                return number + 1
    return None


def value_at(data: Mapping[str, Any], path: str) -> Any:
    """Return the value at a dotted path, or the list on the way to it; None if the path does not exist."""
    value: Any = data
    for part in path.split("."):
        if isinstance(value, list):
            break
        value = value.get(part) if isinstance(value, Mapping) else None
    return value


def _syntax_issue(text: str, error: tomllib.TOMLDecodeError) -> ConfigIssue:
    """Return the issue for a TOML error such as "Invalid value (at line 3, column 11)", with the line it refers to."""
    problem, _, place = str(error).partition(" (at ")
    place = place.rstrip(")")
    if not place.startswith("line"):
        return ConfigIssue(place or "syntax", problem, "check for an unclosed bracket or quote")
    line = text.splitlines()[int(place.split()[1].rstrip(",")) - 1] if place.split()[1].rstrip(",").isdigit() else ""
    remedy = f"the line reads: {line.strip()}" if line.strip() else ""
    if problem == "Invalid value" and "=" in line:
        remedy += "; text needs quotes, true and false are lower case"
    return ConfigIssue(place, problem, remedy)
