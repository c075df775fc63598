"""Config keys that have no effect, because their section uses another backend, or that a study sets itself."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from lsds.contracts import CONFIG_KINDS
from lsds.errors import ConfigError, ConfigIssue

if TYPE_CHECKING:
    from lsds.config import RigConfig


def idle_keys(config: RigConfig, keys: Iterable[str]) -> dict[str, str]:
    """Return the keys `kind.backend.option` of backends that a config does not use, with the backend that it uses."""
    found = {}
    for key in keys:
        kind, _, rest = key.partition(".")
        backend, dot, _ = rest.partition(".")
        if kind in CONFIG_KINDS and dot:
            used = config.section(kind).backend.rpartition(":")[2]
            if used != backend:
                found[key] = used
    return found


def require_objects(config: RigConfig, keys: Iterable[str]) -> None:
    """Raise ConfigError if keys describe objects of a cell that the config does not use: all lifts would be alike."""
    idle = {key: used for key, used in idle_keys(config, keys).items() if key.startswith("cell.")}
    if idle:
        key, used = next(iter(idle.items()))
        problem = f"{key} has no effect on the cell '{used}', and the lifts of this study differ by such keys"
        remedy = f'write cell.backend = "{key.split(".")[1]}"'
        raise ConfigError("the study's objects", [ConfigIssue("cell.backend", problem, remedy)])


def require_free(settings: Iterable[str], varied: Mapping[str, str]) -> None:
    """Raise ConfigError if settings `key=value` fix a key that the study varies; `varied` has the option that does so.

    All runs would be the same one, and counted as different ones.
    """
    issues = [
        ConfigIssue(f"--with {key}", "this study sets the key itself", f"use {varied[key]}")
        for key in (text.partition("=")[0].strip() for text in settings)
        if key in varied
    ]
    if issues:
        raise ConfigError("the study's settings", issues)
