"""Data on installed plugins: their backends, and the plugins that failed."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from lsds.contracts.backend import BackendSpec
from lsds.contracts.kinds import KINDS
from lsds.errors import PluginConflict, PluginNotFound

NO_DEVICE = "none"
"""The backend name in a config for "no backend"."""

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_RESERVED = frozenset({NO_DEVICE, "backend", "enabled"})


@dataclass(frozen=True, slots=True)
class Backend:
    """An available backend, with its distribution and plugin (entry point)."""

    spec: BackendSpec
    distribution: str
    plugin: str

    @property
    def qualified_name(self) -> str:
        """ "distribution:name", as a config has to write it if two distributions offer the same name."""
        return f"{self.distribution}:{self.spec.name}"

    def __str__(self) -> str:
        return f"{self.spec.kind} '{self.spec.name}' of {self.distribution}"


@dataclass(frozen=True, slots=True)
class PluginFailure:
    """An installed plugin that failed to load or is blocked, with the reason."""

    plugin: str
    distribution: str
    reason: str
    blocked: bool = False

    def __str__(self) -> str:
        return f"{self.plugin} ({self.distribution}): {self.reason}"


def checked_specs(offered: object) -> list[BackendSpec]:
    """Return a plugin hook's return value as a list of checked specifications. Raises TypeError or ValueError."""
    if not isinstance(offered, Sequence) or isinstance(offered, str | bytes):
        raise TypeError(f"lsds_backends returned {type(offered).__name__}, expected a list of BackendSpec")
    specs = []
    for item in offered:
        if not isinstance(item, BackendSpec):
            raise TypeError(f"lsds_backends returned a list with {type(item).__name__} in it, expected BackendSpec")
        if item.kind not in KINDS:
            raise ValueError(f"backend '{item.name}' has unknown kind {item.kind!r}; known: {', '.join(KINDS)}")
        if not isinstance(item.name, str) or not _NAME.fullmatch(item.name) or item.name in _RESERVED:
            raise ValueError(f"backend name {item.name!r} is not allowed: letters, digits, '.', '_', '-', not reserved")
        for target in (item.factory, item.options):
            if target is not None and not re.fullmatch(r"[\w.]+:[\w.]+", str(target)):
                raise ValueError(f"backend '{item.name}': {target!r} is not of the form 'module:attribute'")
        specs.append(item)
    return specs


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return "did you mean 'x'?" for the nearest known name, or an empty string."""
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=0.5)
    return f"did you mean '{near[0]}'?" if near else ""


def select(backends: Sequence[Backend], kind: str, name: str, failures: Sequence[PluginFailure] = ()) -> Backend:
    """Return the one backend of that kind and name, which may be "distribution:name" or "plugin:name".

    Raises PluginNotFound and PluginConflict.
    """
    owner, _, bare = name.rpartition(":")
    of_kind = [backend for backend in backends if backend.spec.kind == kind]
    found = [b for b in of_kind if b.spec.name == bare and owner in ("", b.distribution, b.plugin)]
    if len(found) == 1:
        return found[0]
    if found:
        choices = " or ".join(sorted(f"'{b.distribution}:{bare}'" for b in found))
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
