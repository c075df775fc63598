"""Algorithms given to a run as objects: your own detector in the loop, without packaging it."""

from __future__ import annotations

import inspect
import itertools
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from lsds.errors import ConfigError, ConfigIssue
from lsds.registry.in_program import register, unregister

if TYPE_CHECKING:
    from lsds.config import RigConfig

NAME = "given-"
"""Beginning of the name of a backend that is given as an object; a number follows, because runs may overlap."""
_NUMBERS = itertools.count(1)
_OF_A_FINGER = ("tracker", "detector", "estimator")


@contextmanager
def with_parts(config: RigConfig, parts: Mapping[str, Any]) -> Iterator[RigConfig]:
    """Yield the configuration with objects in place of its backends, by kind; None leaves a backend as it is.

    A class or a function is called once for each finger. Raises ConfigError for one object that several fingers would
    share: each needs its own.
    """
    given: dict[Any, Any] = {kind: part for kind, part in parts.items() if part is not None}
    changed: dict[str, Any] = {}
    name = f"{NAME}{next(_NUMBERS)}"
    for kind, part in given.items():
        builds = inspect.isclass(part) or (callable(part) and not hasattr(part, "update"))
        if not builds and kind in _OF_A_FINGER and len(config.fingers) > 1:
            problem = f"{len(config.fingers)} fingers would share one object, and its state"
            raise ConfigError("run", [ConfigIssue(kind, problem, "give the class, or a function that builds one")])
        register(kind, name, part if builds else _same(part))
        changed[kind] = config.section(kind).model_copy(update={"backend": name})
    try:
        yield config.model_copy(update=changed)
    finally:
        for kind in given:
            unregister(kind, name)


def is_given(table: object) -> bool:
    """Return whether a section of a configuration names a backend that was given as an object."""
    return isinstance(table, dict) and str(table.get("backend", "")).startswith(NAME)


def _same(part: Any) -> Any:
    return lambda: part
