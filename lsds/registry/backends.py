"""Data on installed plugins: their backends, and the plugins that failed."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from lsds.contracts.backend import BackendSpec
from lsds.errors import PluginConflict, PluginNotFound

NO_DEVICE = "none"
"""The backend name in a config for "no backend"."""

OWN_DISTRIBUTION = "lsds-tactile"
"""The distribution of the first-party plugins, which is the one that pip installs."""

OWN_PREFIX = "lsds"
"""Stands for that distribution in a config: "lsds:fused"."""

NO_DISTRIBUTION = "unknown"
"""Stands for the distribution of an entry point that has none."""


@dataclass(frozen=True, slots=True)
class Backend:
    """An available backend, with its distribution and plugin (entry point)."""

    spec: BackendSpec
    distribution: str
    plugin: str

    @property
    def qualified_name(self) -> str:
        """ "distribution:name", as a config has to write it if two distributions offer the same name."""
        return f"{prefix_of(self.distribution)}:{self.spec.name}"

    def __str__(self) -> str:
        return f"{self.spec.kind} '{self.spec.name}' of {self.distribution}"


@dataclass(frozen=True, slots=True)
class PluginFailure:
    """An installed plugin that failed to load or is blocked, with the reason."""

    plugin: str
    distribution: str
    reason: str
    blocked: bool = False
    remedy: str = ""

    def __str__(self) -> str:
        remedy = f"; {self.remedy}" if self.remedy else ""
        return f"{self.plugin} ({self.distribution}): {self.reason}{remedy}"


@dataclass(frozen=True, slots=True)
class PluginNote:
    """A remark on a plugin that works, such as what it printed; `distribution` is empty if it is not installed."""

    plugin: str
    distribution: str
    text: str

    def __str__(self) -> str:
        return (
            f"{self.plugin} ({self.distribution}): {self.text}" if self.distribution else f"{self.plugin}: {self.text}"
        )


def prefix_of(distribution: str) -> str:
    """Return what a config writes before the colon for a backend of that distribution."""
    return OWN_PREFIX if distribution == OWN_DISTRIBUTION else distribution


def owner_names(plugin: str, distribution: str) -> frozenset[str]:
    """Return all names by which a config may select or block that plugin of that distribution."""
    return frozenset({plugin, distribution, prefix_of(distribution)})


def is_named(backend: Backend, name: str) -> bool:
    """Return whether "name", "distribution:name" or "plugin:name" names the backend."""
    owner, _, bare = name.rpartition(":")
    return bare == backend.spec.name and (not owner or owner in owner_names(backend.plugin, backend.distribution))


def did_you_mean(name: str, known: Iterable[str], cutoff: float = 0.5) -> str:
    """Return "did you mean 'x'?" for the nearest known name of at least that similarity, or an empty string."""
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=cutoff)
    return f"did you mean '{near[0]}'?" if near else ""


def select(backends: Sequence[Backend], kind: str, name: str, failures: Sequence[PluginFailure] = ()) -> Backend:
    """Return the one backend of that kind and name, which may be "distribution:name" or "plugin:name".

    Raises PluginNotFound and PluginConflict.
    """
    bare = name.rpartition(":")[2]
    of_kind = [backend for backend in backends if backend.spec.kind == kind]
    found = [backend for backend in of_kind if is_named(backend, name)]
    if len(found) == 1:
        return found[0]
    if found:
        choices = " or ".join(sorted(f"'{b.qualified_name}'" for b in found))
        if len({b.distribution for b in found}) == 1:
            choices = " or ".join(sorted(f"'{b.plugin}:{bare}'" for b in found))
        raise PluginConflict(f"{len(found)} plugins offer {kind} '{bare}'; choose one: {choices}")
    known = sorted({b.spec.name for b in of_kind})
    hint = did_you_mean(bare, known)
    parts = [f"no installed plugin offers {kind} '{name}'"]
    if hint:
        parts.append(hint)
    parts.append(f"installed: {', '.join(known) if known else 'none'}")
    parts += [f"note: plugin {failure}" for failure in failures]
    raise PluginNotFound("; ".join(parts))
