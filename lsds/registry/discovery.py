"""Find the entry points of installed distributions one by one, past those that are damaged."""

from __future__ import annotations

from contextlib import suppress
from importlib.metadata import Distribution, EntryPoint, distributions

from lsds.registry.backends import NO_DISTRIBUTION, PluginFailure
from lsds.registry.containment import one_line
from lsds.registry.spec import PROJECT


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
