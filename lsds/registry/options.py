"""Convert pydantic's errors to `ConfigIssue`s with a dotted path, a plain message and a suggestion."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError

from lsds.errors import ConfigError, ConfigIssue
from lsds.registry.backends import did_you_mean
from lsds.registry.containment import one_line

M = TypeVar("M", bound=BaseModel)


def validated(model: type[M], raw: Mapping[str, Any], path: str, remedy: str = "") -> M:
    """Return the options table `raw`, found at the dotted `path`, as its model. Raises ConfigError with all issues.

    `remedy` is added if the model itself is broken.
    """
    try:
        return model.model_validate(raw)
    except ValidationError as error:
        raise ConfigError(f"[{path}]", list(issues_of(error, model, path))) from error
    except Exception as error:
        raise ConfigError(f"[{path}]", [ConfigIssue(path, _broken(error), remedy)]) from error


def table_issues(
    model: type[BaseModel], raw: Mapping[str, Any], path: str, remedy: str = ""
) -> tuple[ConfigIssue, ...]:
    """Return the issues of an options table, empty if it is valid; arguments as for `validated`."""
    try:
        validated(model, raw, path, remedy)
    except ConfigError as error:
        return error.issues
    return ()


def _broken(error: Exception) -> str:
    return f"its options model raised {type(error).__name__}: {one_line(error)}"


def issues_of(error: ValidationError, model: type[BaseModel], path: str = "") -> Iterator[ConfigIssue]:
    """Yield one issue for each pydantic error."""
    for detail in error.errors(include_url=False):
        location = tuple(detail["loc"])
        where = ".".join([path, *map(str, location)] if path else map(str, location)) or "(root)"
        kind = detail["type"]
        if kind == "extra_forbidden":
            known = _keys_at(model, location[:-1])
            remedy = did_you_mean(str(location[-1]), known) or (f"known keys: {', '.join(known)}" if known else "")
            yield ConfigIssue(where, "unknown key", remedy)
        elif kind in ("literal_error", "enum"):
            choices = re.findall(r"'([^']*)'", str(detail.get("ctx", {}).get("expected", "")))
            hint = did_you_mean(str(detail["input"]), choices)
            remedy = " ".join(part for part in (hint, f"one of: {', '.join(choices)}" if choices else "") if part)
            yield ConfigIssue(where, f"{detail['input']!r} is not allowed", remedy)
        elif kind in ("tuple_type", "list_type"):
            given = detail["input"]
            written = f'"{given}"' if isinstance(given, str) else given
            remedy = "" if isinstance(given, Mapping) else f"{location[-1]} = [{written}]"
            yield ConfigIssue(where, f"should be a list, got {given!r}", remedy)
        elif isinstance(detail["input"], float) and math.isnan(detail["input"]):
            yield ConfigIssue(where, "is NaN, not a number", _description(model, location))
        elif kind == "missing":
            yield ConfigIssue(where, "is missing", _description(model, location))
        else:
            message = detail["msg"].removeprefix("Value error, ").replace("Input should", "should")
            given = "" if isinstance(detail["input"], Mapping | list) else f", got {detail['input']!r}"
            remedy = f"put it in quotes: '\"{detail['input']}\"'" if kind == "string_type" and given else ""
            yield ConfigIssue(where, message + given, remedy)


def _description(model: type[BaseModel], location: tuple[Any, ...]) -> str:
    """Return what an option of a table's first level is."""
    field = model.model_fields.get(str(location[0])) if len(location) == 1 else None
    return (field.description or "") if field is not None else ""


def _keys_at(model: type[BaseModel], location: tuple[Any, ...]) -> list[str]:
    """Return the keys that a table allows, following nested models by their annotations."""
    current: type[BaseModel] = model
    for part in location:
        if isinstance(part, int):
            continue  # An index into a list of tables.
        field = current.model_fields.get(str(part))
        kinds = () if field is None else (field.annotation, *get_args(field.annotation))
        nested = next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel)), None)
        if nested is None:
            return []
        current = nested
    return sorted(current.model_fields)
