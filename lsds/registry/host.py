"""The plugin host: finds backends, isolates broken plugins, builds the backends of a config."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

import pluggy

from lsds.contracts.backend import BuildContext
from lsds.contracts.former import as_controller
from lsds.contracts.kinds import KINDS, Kind
from lsds.errors import ConfigError, ConfigIssue, LsdsError, PluginConflict, PluginLoadError
from lsds.registry import in_program
from lsds.registry.backends import (
    OWN_DISTRIBUTION,
    OWN_PREFIX,
    Backend,
    PluginFailure,
    PluginNote,
    did_you_mean,
    owner_names,
    select,
)
from lsds.registry.containment import contained, diverted, one_line
from lsds.registry.contract import check_contract
from lsds.registry.discovery import distribution_of, installed_entry_points, readable_entry_points
from lsds.registry.importing import importable, imported_target, remedy_for, require_model
from lsds.registry.loading import failure_of, new_manager, offered_specs, upgrade_or_block
from lsds.registry.spec import PROJECT

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from pydantic import BaseModel

BLOCK_VARIABLE = "LSDS_BLOCK_PLUGINS"
"""Environment variable: comma-separated distributions or plugins that are not to be loaded."""


class EntryPointLike(Protocol):
    """The members of an entry point that the host uses; `importlib.metadata.EntryPoint` has them."""

    @property
    def name(self) -> str:
        """Name of the plugin."""
        ...

    @property
    def dist(self) -> Any:
        """The distribution it came with, or None."""
        ...

    def load(self) -> Any:
        """Import and return the manifest module."""
        ...


class PluginHost:
    """All installed plugins of the entry-point group `lsds`.

    Manifests are imported on first use, backends when they are built. A plugin that fails to import, or whose hook
    returns an invalid value, is listed in `failures` and does not affect others. Output of a plugin while it is
    imported is kept from stdout and listed in `notes`; what it prints while a backend is built goes to stderr.

    `entry_points` replaces what is installed (for tests and embedding); `block` names distributions or plugins that
    are not to be loaded, in addition to the environment variable `LSDS_BLOCK_PLUGINS`.
    """

    def __init__(self, *, entry_points: Iterable[EntryPointLike] | None = None, block: Collection[str] = ()) -> None:
        self._entry_points = entry_points
        self._blocked = set(block) | {name.strip() for name in os.environ.get(BLOCK_VARIABLE, "").split(",")} - {""}
        self._failures: list[PluginFailure] = []
        self._backends: list[Backend] = []
        self._notes: list[PluginNote] = []
        self._installed: set[str] = set()
        self._loaded = False
        self._listed: tuple[object, tuple[Backend, ...]] | None = None

    # -- listing ------------------------------------------------------------------------------------------

    @property
    def backends(self) -> tuple[Backend, ...]:
        """All backends that are not blocked, in order of kind and name."""
        self._load()
        # The program itself may register a backend at any time.
        own = () if self._entry_points is not None else in_program.specs()
        state = (len(self._backends), frozenset(self._blocked), own)
        if self._listed is None or self._listed[0] != state:
            known = [
                *self._backends,
                *(Backend(spec, in_program.DISTRIBUTION, in_program.DISTRIBUTION) for spec in own),
            ]
            offered = [b for b in known if not self._is_blocked(b.plugin, b.distribution)]
            offered.sort(key=lambda b: (b.spec.kind, b.spec.name, b.distribution))
            self._listed = state, tuple(offered)
        return self._listed[1]

    @property
    def failures(self) -> tuple[PluginFailure, ...]:
        """All plugins that failed to load or are blocked, with the reason."""
        self._load()
        loaded = {(b.plugin, b.distribution) for b in self._backends}
        late = [
            PluginFailure(plugin, distribution, "blocked", blocked=True)
            for plugin, distribution in sorted(loaded)
            if self._is_blocked(plugin, distribution)
        ]
        return (*self._failures, *late)

    @property
    def notes(self) -> tuple[PluginNote, ...]:
        """All remarks so far: what plugins printed while they were imported, and blocked names that do not exist."""
        blocked = [
            PluginNote(name, "", f"is blocked, but not installed{f'; {hint}' if hint else '; check the name'}")
            for name, hint in self.unknown_blocks().items()
        ]
        return (*self._notes, *blocked)

    def unknown_blocks(self) -> dict[str, str]:
        """Return the blocked names that no plugin and no distribution has, each with "did you mean 'x'?" or ""."""
        self._load()
        return {name: did_you_mean(name, self._installed, 0.8) for name in sorted(self._blocked - self._installed)}

    def names(self, kind: Kind) -> tuple[str, ...]:
        """Return the names of all backends of a kind, each once."""
        return tuple(dict.fromkeys(b.spec.name for b in self.backends if b.spec.kind == kind))

    def block(self, names: Iterable[str]) -> None:
        """Block further distributions or plugins, as `[plugins] block` in a config does."""
        self._blocked.update(names)

    def register(self, plugin: object, *, distribution: str, name: str | None = None) -> None:
        """Add a plugin (a module, or any object with hook implementations) that no entry point names."""
        self._load()
        label = name or getattr(plugin, "__name__", None) or type(plugin).__name__
        self._installed |= owner_names(label, distribution)
        self._take(lambda: plugin, label, distribution)

    def find(self, kind: Kind, name: str) -> Backend:
        """Return the backend of that kind and name ("name" or "distribution:name").

        Raises PluginNotFound with a suggestion, and PluginConflict if two plugins offer the name.
        """
        return select(self.backends, kind, name, self.failures)

    def own(self, kind: Kind, name: str) -> str:
        """Return how to write a backend that lsds, not the user, chooses by name.

        This is "lsds:name" if other plugins claim the name too, else the name as it is.
        """
        try:
            self.find(kind, name)
        except PluginConflict:
            return f"{OWN_PREFIX}:{name}" if self._offers_own(kind, name) else name
        except LsdsError:
            pass
        return name

    # -- building -----------------------------------------------------------------------------------------

    def missing_requirements(self, backend: Backend) -> tuple[str, ...]:
        """Return the import names required by the backend that are not installed."""
        names = backend.spec.requires
        if not any("." in name for name in names):
            return _missing(names)
        # To find a module inside a package, Python imports the package.
        missing: tuple[str, ...] = self.contained(backend, f"importing {', '.join(names)}", lambda: _missing(names))
        return missing

    def options_model(self, backend: Backend) -> type[BaseModel] | None:
        """Return the pydantic model of a backend's options table, None where it takes none. Raises PluginLoadError."""
        if backend.spec.options is None:
            return None
        return require_model(backend, self._import(backend, backend.spec.options))

    def imported(self, backend: Backend) -> Any:
        """Return the object named by a backend's `factory`, without calling it. Raises PluginLoadError."""
        return self._import(backend, backend.spec.factory)

    def build(self, kind: Kind, name: str, raw_options: Mapping[str, Any] | None, context: BuildContext) -> Any:
        """Build a backend: import it, validate the options, call the factory and check the contract.

        Raises PluginNotFound, PluginConflict, PluginLoadError, ConfigError, ContractMismatch.
        """
        backend = self.find(kind, name)
        if missing := self.missing_requirements(backend):
            raise PluginLoadError(
                f"{backend} needs {', '.join(missing)}, which is not installed; {remedy_for(backend)}"
            )
        options = self._options(backend, raw_options or {})
        if context.default_cell is None:
            context.default_cell = self._default_cell
        if context.wired_cell is None:
            context.wired_cell = self._wired_cell
        factory = self.imported(backend)
        try:
            with diverted():
                built = factory(options, context)
        except (LsdsError, KeyboardInterrupt):
            raise
        except BaseException as error:
            raise PluginLoadError(
                f"{backend}: its factory '{backend.spec.factory}' raised {type(error).__name__}: {one_line(error)}; "
                f"{upgrade_or_block(backend.plugin, backend.distribution)}"
            ) from error
        if kind == "controller":
            built = as_controller(built, str(backend))
        check_contract(str(backend), kind, built, f"lsds plugins show {backend.qualified_name} lists the members")
        if kind == "cell":
            context.install_cell(built)
        return built

    def contained(self, backend: Backend, doing: str, run: Callable[[], Any]) -> Any:
        """Return what `run`, code of that backend, returns; its output becomes a note, "printed while" `doing`."""
        output = None
        try:
            # Libraries add warning filters when they are imported, for good.
            with contained(filters=False) as output:
                return run()
        finally:
            if output is not None and output.text:
                self._note(backend.plugin, backend.distribution, f"printed while {doing}: {output.text}")

    # -- inside -------------------------------------------------------------------------------------------

    def _default_cell(self, context: BuildContext) -> Any:
        return self.build("cell", self.own("cell", KINDS["cell"].default), {}, context)

    def _wired_cell(self, context: BuildContext, address: str) -> Any:
        """Return the cell on the wire whose plant serves at an address; None without such a backend."""
        names = [
            backend.spec.name for backend in self.backends if backend.spec.kind == "cell" and backend.spec.over_wire
        ]
        return self.build("cell", names[0], {"socket": address, "start": False}, context) if names else None

    def _options(self, backend: Backend, raw: Mapping[str, Any]) -> BaseModel | None:
        from lsds.registry.options import validated

        path = f"{backend.spec.kind}.{backend.spec.name}"
        model = self.options_model(backend)
        if model is not None:
            with diverted():  # A validator is code of the plugin.
                return validated(model, raw, path, upgrade_or_block(backend.plugin, backend.distribution))
        if raw:
            raise ConfigError(
                f"[{path}]", [ConfigIssue(f"{path}.{key}", "this backend takes no options") for key in raw]
            )
        return None

    def _import(self, backend: Backend, target: str) -> Any:
        module = target.partition(":")[0]
        return self.contained(backend, f"importing {module}", lambda: imported_target(backend, target))

    def _note(self, plugin: str, distribution: str, text: str) -> None:
        note = PluginNote(plugin, distribution, text)
        if note not in self._notes:
            self._notes.append(note)

    @cached_property
    def _manager(self) -> pluggy.PluginManager:
        return new_manager()

    def _offers_own(self, kind: Kind, name: str) -> bool:
        return any((b.spec.kind, b.spec.name, b.distribution) == (kind, name, OWN_DISTRIBUTION) for b in self.backends)

    def _is_blocked(self, plugin: str, distribution: str) -> bool:
        return not self._blocked.isdisjoint(owner_names(plugin, distribution))

    def _load(self) -> None:
        if self._loaded:
            return
        self._loaded = True
        # First-party plugins first: those that the distribution of the former name still offers are the duplicates.
        found = [(entry_point, distribution_of(entry_point)) for entry_point in self._found()]
        for entry_point, distribution in sorted(found, key=lambda each: each[1] != OWN_DISTRIBUTION):
            name = entry_point.name
            self._installed |= owner_names(name, distribution)
            if self._is_blocked(name, distribution):
                self._failures.append(PluginFailure(name, distribution, "blocked", blocked=True))
                continue
            self._take(entry_point.load, name, distribution)

    def _found(self) -> Iterable[EntryPointLike | EntryPoint]:
        if self._entry_points is not None:
            return self._entry_points
        try:
            return installed_entry_points(group=PROJECT)
        except Exception:
            found, failures = readable_entry_points()
            self._failures += failures
            return found

    def _take(self, load: Callable[[], object], name: str, distribution: str) -> None:
        """Load a plugin and keep its backends, or its failure; a plugin may raise anything, including SystemExit."""
        with contained() as output:
            try:
                specs = offered_specs(self._manager, load(), f"{distribution}:{name}")
            except KeyboardInterrupt:
                raise
            except BaseException as error:
                self._failures.append(failure_of(name, distribution, error))
            else:
                self._backends += [Backend(spec, distribution, name) for spec in specs]
        if output.text:
            self._note(name, distribution, f"printed while loading: {output.text}")


def _missing(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(name for name in names if not importable(name))
