"""The plugin host: finds backends, isolates broken plugins, builds the backends of a config."""

from __future__ import annotations

import importlib
import importlib.util
import os
from collections.abc import Collection, Iterable, Mapping
from functools import cached_property
from importlib.metadata import entry_points as installed_entry_points
from typing import TYPE_CHECKING, Any, Protocol

import pluggy

from lsds.contracts.backend import BackendSpec, BuildContext
from lsds.contracts.kinds import Kind
from lsds.errors import ConfigError, ConfigIssue, LsdsError, PluginLoadError
from lsds.plugins import spec as hookspecs
from lsds.plugins.contract import check_contract
from lsds.plugins.registry import Backend, PluginFailure, checked_specs, select

if TYPE_CHECKING:
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
    returns an invalid value, is listed in `failures` and does not affect others.

    `entry_points` replaces what is installed (for tests and embedding); `block` names distributions or plugins that
    are not to be loaded, in addition to the environment variable `LSDS_BLOCK_PLUGINS`.
    """

    def __init__(self, *, entry_points: Iterable[EntryPointLike] | None = None, block: Collection[str] = ()) -> None:
        self._entry_points = entry_points
        self._blocked = set(block) | {name.strip() for name in os.environ.get(BLOCK_VARIABLE, "").split(",")} - {""}
        self._failures: list[PluginFailure] = []
        self._backends: list[Backend] = []
        self._loaded = False

    # -- listing ------------------------------------------------------------------------------------------

    @property
    def backends(self) -> tuple[Backend, ...]:
        """All backends that are not blocked, in order of kind and name."""
        self._load()
        offered = [b for b in self._backends if not self._is_blocked(b.plugin, b.distribution)]
        return tuple(sorted(offered, key=lambda b: (b.spec.kind, b.spec.name, b.distribution)))

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
        self._take(plugin, label, distribution)

    def find(self, kind: Kind, name: str) -> Backend:
        """Return the backend of that kind and name ("name" or "distribution:name").

        Raises PluginNotFound with a suggestion, and PluginConflict if two plugins offer the name.
        """
        return select(self.backends, kind, name, self.failures)

    # -- building -----------------------------------------------------------------------------------------

    def missing_requirements(self, backend: Backend) -> tuple[str, ...]:
        """Return the import names required by the backend that are not installed."""
        return tuple(name for name in backend.spec.requires if not _importable(name))

    def options_model(self, backend: Backend) -> type[BaseModel] | None:
        """Return the pydantic model of a backend's options table, None where it takes none. Raises PluginLoadError."""
        if backend.spec.options is None:
            return None
        from pydantic import BaseModel

        model = self._import(backend, backend.spec.options)
        if not (isinstance(model, type) and issubclass(model, BaseModel)):
            raise PluginLoadError(f"{backend}: options '{backend.spec.options}' is not a pydantic model")
        return model

    def imported(self, backend: Backend) -> Any:
        """Return the object named by a backend's `factory`, without calling it. Raises PluginLoadError."""
        return self._import(backend, backend.spec.factory)

    def build(self, kind: Kind, name: str, raw_options: Mapping[str, Any] | None, context: BuildContext) -> Any:
        """Build a backend: import it, validate the options, call the factory and check the contract.

        Raises PluginNotFound, PluginConflict, PluginLoadError, ConfigError, ContractMismatch.
        """
        backend = self.find(kind, name)
        if missing := self.missing_requirements(backend):
            raise PluginLoadError(f"{backend} needs {', '.join(missing)}, which is not installed; {_remedy(backend)}")
        options = self._options(backend, raw_options or {})
        factory = self.imported(backend)
        try:
            built = factory(options, context)
        except LsdsError:
            raise
        except Exception as error:
            raise PluginLoadError(
                f"{backend}: its factory '{backend.spec.factory}' raised {type(error).__name__}: {error}"
            ) from error
        check_contract(str(backend), kind, built)
        return built

    # -- inside -------------------------------------------------------------------------------------------

    def _options(self, backend: Backend, raw: Mapping[str, Any]) -> BaseModel | None:
        from lsds.plugins.options import validated

        path = f"{backend.spec.kind}.{backend.spec.name}"
        model = self.options_model(backend)
        if model is not None:
            return validated(model, raw, path)
        if raw:
            raise ConfigError(
                f"[{path}]", [ConfigIssue(f"{path}.{key}", "this backend takes no options") for key in raw]
            )
        return None

    def _import(self, backend: Backend, target: str) -> Any:
        module_name, _, attribute = target.partition(":")
        try:
            value: Any = importlib.import_module(module_name)
            for part in attribute.split("."):
                value = getattr(value, part)
        except Exception as error:
            raise PluginLoadError(
                f"{backend}: importing '{target}' failed: {type(error).__name__}: {error}; {_remedy(backend)}"
            ) from error
        return value

    @cached_property
    def _manager(self) -> pluggy.PluginManager:
        manager = pluggy.PluginManager(hookspecs.PROJECT)
        manager.add_hookspecs(hookspecs)
        return manager

    def _is_blocked(self, plugin: str, distribution: str) -> bool:
        return plugin in self._blocked or distribution in self._blocked

    def _load(self) -> None:
        if self._loaded:
            return
        self._loaded = True
        found = self._entry_points
        if found is None:
            found = installed_entry_points(group=hookspecs.PROJECT)
        for entry_point in found:
            distribution = str(getattr(entry_point.dist, "name", None) or "unknown")
            if self._is_blocked(entry_point.name, distribution):
                self._failures.append(PluginFailure(entry_point.name, distribution, "blocked", blocked=True))
                continue
            try:
                plugin = entry_point.load()
            # A plugin may raise anything while it is imported, including SystemExit.
            except (Exception, SystemExit) as error:
                self._fail(entry_point.name, distribution, error)
            else:
                self._take(plugin, entry_point.name, distribution)

    def _take(self, plugin: object, name: str, distribution: str) -> None:
        registered_as = f"{distribution}:{name}"
        try:
            self._manager.register(plugin, name=registered_as)
            self._manager.check_pending()
            specs: list[BackendSpec] = []
            for implementation in self._manager.hook.lsds_backends.get_hookimpls():
                if implementation.plugin is plugin:
                    specs += checked_specs(implementation.function())
        except (Exception, SystemExit) as error:
            self._fail(name, distribution, error)
            if self._manager.has_plugin(registered_as):
                self._manager.unregister(plugin)
        else:
            self._backends += [Backend(spec, distribution, name) for spec in specs]

    def _fail(self, name: str, distribution: str, error: BaseException) -> None:
        reason = f"{type(error).__name__}: {error}"
        self._failures.append(PluginFailure(name, distribution, reason))


def _importable(name: str) -> bool:
    try:
        return importlib.util.find_spec(name) is not None
    except (ImportError, ValueError):
        return False


def _remedy(backend: Backend) -> str:
    if backend.spec.extra:
        return f"install it with: pip install '{backend.distribution}[{backend.spec.extra}]'"
    return f"see the documentation of {backend.distribution}"
