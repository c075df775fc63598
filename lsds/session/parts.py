"""Algorithms given to a run as objects: your own detector in the loop, without packaging it."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from lsds.errors import ConfigError, ConfigIssue
from lsds.registry.in_program import register, unregister

if TYPE_CHECKING:
    from lsds.config import RigConfig
    from lsds.contracts.kinds import Kind

NAME = "given"
"""Name of a backend that is given as an object."""
_OF_A_FINGER = ("tracker", "detector", "estimator")


@contextmanager
def with_parts(config: RigConfig, parts: Mapping[str, Any]) -> Iterator[RigConfig]:
    """Yield the configuration with objects in place of its backends, by kind; None leaves a backend as it is.

    A class or a function is called once for each finger. Raises ConfigError for one object that several fingers would
    share: each needs its own.
    """
    given: dict[Any, Any] = {kind: part for kind, part in parts.items() if part is not None}
    changed: dict[str, Any] = {}
    for kind, part in given.items():
        builds = inspect.isclass(part) or (callable(part) and not hasattr(part, "update"))
        if not builds and kind in _OF_A_FINGER and len(config.fingers) > 1:
            problem = f"{len(config.fingers)} fingers would share one object, and its state"
            raise ConfigError("run", [ConfigIssue(kind, problem, "give the class, or a function that builds one")])
        register(kind, NAME, part if builds else _same(part))
        changed[kind] = _section(config, kind)
    try:
        yield config.model_copy(update=changed)
    finally:
        for kind in given:
            unregister(kind, NAME)


def _section(config: RigConfig, kind: Kind) -> Any:
    """Return the section of a kind with the given backend; other keys of the section stay."""
    return config.section(kind).model_copy(update={"backend": NAME})


def _same(part: Any) -> Any:
    return lambda: part
