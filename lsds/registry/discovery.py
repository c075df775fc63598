"""Find the entry points of installed distributions, past those that are damaged, and read them once in a process."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import Distribution, EntryPoint, distributions, entry_points
from typing import Any

from lsds.registry.backends import NO_DISTRIBUTION, PluginFailure
from lsds.registry.containment import one_line
from lsds.registry.spec import PROJECT


@dataclass(frozen=True, slots=True)
class Owner:
    """The distribution of an entry point."""

    name: str


@dataclass(frozen=True, slots=True)
class InstalledPlugin:
    """An entry point whose distribution's metadata have been read."""

    name: str
    dist: Owner
    load: Callable[[], Any]


def installed_entry_points(group: str) -> tuple[InstalledPlugin, ...]:
    """Return the entry points of a group; they are read again if a folder of the module search path has changed.

    Raises whatever a damaged distribution raises.
    """
    return _installed(group, tuple((folder, _changed_ns(folder)) for folder in sys.path))


def _changed_ns(folder: str) -> int | None:
    try:
        return os.stat(folder or ".").st_mtime_ns
    except OSError:
        return None


@lru_cache(maxsize=4)
def _installed(group: str, path: tuple[tuple[str, int | None], ...]) -> tuple[InstalledPlugin, ...]:
    found = entry_points(group=group)
    return tuple(InstalledPlugin(each.name, Owner(distribution_of(each)), each.load) for each in found)


def distribution_of(entry_point: Any) -> str:
    """Return the name of an entry point's distribution, whose metadata may be damaged."""
    with suppress(Exception):
        return str(entry_point.dist.name or NO_DISTRIBUTION)
    return NO_DISTRIBUTION


def readable_entry_points() -> tuple[list[EntryPoint], list[PluginFailure]]:
    """Return the entry points of plugins, and a failure for each distribution whose entry points cannot be read.

    `importlib.metadata.entry_points` is faster, but raises if one distribution is damaged, whatever it is for.
    """
    found: list[EntryPoint] = []
    failures: list[PluginFailure] = []
    seen: set[str] = set()
    for distribution in distributions():
        name = _name(distribution)
        if name in seen:
            continue  # One that is earlier on the path hides it.
        seen |= {name} - {NO_DISTRIBUTION}
        try:
            found += [entry for entry in distribution.entry_points if entry.group == PROJECT]
        except Exception as error:
            reason = f"its entry points cannot be read: {type(error).__name__}: {one_line(error)}"
            remedy = f"install it again: pip install --force-reinstall {name}"
            failures.append(PluginFailure(name, name, reason, remedy=remedy))
    return found, failures


def _name(distribution: Distribution) -> str:
    with suppress(Exception):
        return str(distribution.metadata["Name"] or NO_DISTRIBUTION)
    return NO_DISTRIBUTION
