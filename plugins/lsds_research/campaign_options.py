"""Options that campaigns of many runs have in common."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, Field

from lsds.config.overrides import override_texts, parse_override
from lsds.errors import ConfigIssue
from lsds_research.cluster import HELP
from lsds_research.search.space import flat

_DOTTED = re.compile(r"[\w-]+(\.[\w-]+)*", re.ASCII)


def without_tables(settings: Sequence[str]) -> list[str]:
    """Return settings `key=value` with each value of a table as a separate setting.

    A table as a whole would replace the keys that a study draws or varies in it.
    """
    found: list[str] = []
    for text in settings:
        parsed = parse_override(text)
        if isinstance(parsed, ConfigIssue) or not isinstance(parsed[1], dict):
            found.append(text)
            continue
        keys = dict(flat(parsed[1], ".".join(parsed[0]) + "."))
        # Quoted keys, which no study varies, cannot be written as dotted ones.
        found += override_texts(keys) if all(_DOTTED.fullmatch(key) for key in keys) else [text]
    return found


Settings = Annotated[
    list[str],
    AfterValidator(without_tables),
    Field(description="config key that every run sets", json_schema_extra={"flag": "--with", "metavar": "KEY=VALUE"}),
]
Out = Annotated[
    str,
    Field(
        description="store each run in this file (JSON lines); the same command continues from it",
        json_schema_extra={"metavar": "FILE"},
    ),
]
Jobs = Annotated[int, Field(ge=1, le=256)]
"""Number of processes; each campaign describes what one process runs."""
Cluster = Annotated[str, Field(description=HELP, json_schema_extra={"metavar": "ADDRESS"})]
Random = Annotated[
    bool,
    Field(
        description="draw shape, size, mass, friction, stiffness, relief and gel instead of objects of the catalogue; "
        "what a firm grip does not hold either is no failure"
    ),
]


Options = TypeVar("Options", bound=BaseModel)


def quickened(options: Options, few: Mapping[str, Any]) -> Options:
    """Return the options; with `quick`, fields that were not given have the values of `few`."""
    if not getattr(options, "quick", False):
        return options
    return options.model_copy(update={name: few[name] for name in few if name not in options.model_fields_set})


def thinned(options: BaseModel, name: str, every: int) -> list[Any]:
    """Return a list of the options, with `quick` one value of each `every`; a list that was given is kept whole."""
    values: list[Any] = getattr(options, name)
    return values[::every] if getattr(options, "quick", False) and name not in options.model_fields_set else values
