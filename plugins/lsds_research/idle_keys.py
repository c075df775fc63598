"""Config keys that have no effect, because their section uses another backend, or that a study sets itself."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from lsds.contracts import CONFIG_KINDS
from lsds.errors import ConfigError, ConfigIssue

if TYPE_CHECKING:
    from lsds.config import RigConfig


LIFT = "lift"
"""Job whose end is a verdict on the grip."""
ENDLESS = ("hold", "watch")
"""Jobs that end by themselves only after their `duration_s`."""


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


def require_lift(config: RigConfig) -> None:
    """Raise ConfigError for another job than a lift: it may release the object on purpose, or never end."""
    name = config.section("job").backend.rpartition(":")[2]
    if name != LIFT:
        problem = f"'{name}' is no lift, and this study counts lifts that lose their object"
        raise ConfigError("the study's job", [ConfigIssue("job.backend", problem, f'write job.backend = "{LIFT}"')])


def require_end(config: RigConfig) -> None:
    """Raise ConfigError for a job that never ends by itself."""
    job = config.section("job")
    name = job.backend.rpartition(":")[2]
    if name in ENDLESS and not job.options().get("duration_s"):
        problem = f"'{name}' never ends by itself, and this study waits for the end of each run"
        remedy = f'write job.backend = "{LIFT}", or job.{name}.duration_s = 1'
        raise ConfigError("the study's job", [ConfigIssue("job.backend", problem, remedy)])


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
