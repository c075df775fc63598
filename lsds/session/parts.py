"""The arguments of a run: its configuration in any form, and algorithms as objects, without packaging them."""

from __future__ import annotations

import inspect
import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from lsds.config import RigConfig, check_config, load_config
from lsds.config.overrides import apply_overrides, override_texts
from lsds.errors import ConfigError, ConfigIssue
from lsds.registry import PluginHost
from lsds.registry.in_program import register, unregister

NAME = "given-"
"""Beginning of the name of a backend that is given as an object; a number follows, because runs may overlap."""
_NUMBERS = itertools.count(1)
_OF_A_FINGER = ("tracker", "detector", "estimator")


def loaded(
    config: RigConfig | Mapping[str, Any] | str | Path | None, overrides: str | Sequence[str] | Mapping[str, Any]
) -> RigConfig:
    """Return the configuration of a run: one, its file, or its keys with values; with overrides. Raises ConfigError."""
    texts = _texts(overrides)
    if isinstance(config, Mapping):
        return load_config(None, [*_texts(config), *texts])
    if not isinstance(config, RigConfig):
        return load_config(config, texts)
    if not texts:
        return config
    if any(text.partition("=")[0].strip() == "calibration" for text in texts):
        problem = "a configuration holds the values of its calibration already"
        raise ConfigError("overrides", [ConfigIssue("calibration", problem, "load the file with this override")])
    tables = config.as_tables()
    issues = apply_overrides(tables, tuple(texts))
    return check_config(tables, "the configuration with overrides", PluginHost(), issues)


def _texts(overrides: str | Sequence[str] | Mapping[str, Any]) -> list[str]:
    if isinstance(overrides, str):
        return [overrides]
    if isinstance(overrides, Mapping):
        try:
            return override_texts(overrides)
        except TypeError as error:
            raise ConfigError(
                "overrides", [ConfigIssue("overrides", str(error), "give numbers, texts or lists")]
            ) from None
    if isinstance(overrides, Iterable):
        texts = list(overrides)
        if all(isinstance(text, str) for text in texts):
            return texts
    remedy = 'give texts such as "task.lift_s=1", or a mapping of config keys'
    raise ConfigError("overrides", [ConfigIssue("overrides", f"{overrides!r} is not usable", remedy)])


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
