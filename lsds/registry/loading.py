"""Load one plugin: register its hooks, call them, and explain what is wrong."""

from __future__ import annotations

from typing import Any

import pluggy

from lsds.contracts.backend import BackendSpec
from lsds.registry import spec as hookspecs
from lsds.registry.backends import NO_DISTRIBUTION, PluginFailure, did_you_mean
from lsds.registry.checks import Refused, checked_specs
from lsds.registry.containment import one_line

_HOOK = "lsds_backends"


def new_manager() -> pluggy.PluginManager:
    """Return a plugin manager that knows the hooks of lsds."""
    manager = pluggy.PluginManager(hookspecs.PROJECT)
    manager.add_hookspecs(hookspecs)
    return manager


def offered_specs(manager: pluggy.PluginManager, plugin: object, name: str) -> list[BackendSpec]:
    """Register a plugin and return its checked specifications. Raises Refused, and whatever its hook raises."""
    if manager.has_plugin(name) or manager.is_registered(plugin):
        raise Refused("it is installed twice", "remove one of its entry points, or uninstall it and install it again")
    try:
        manager.register(plugin, name=name)
    except pluggy.PluginValidationError as error:
        problem = one_line(error).rpartition("Details: ")[2] or one_line(error)
        raise Refused(problem, f"write @hookimpl def {_HOOK}(): without parameters") from error
    try:
        _require_known_hooks(manager, plugin)
        specs: list[BackendSpec] = []
        for implementation in manager.hook.lsds_backends.get_hookimpls():
            if implementation.plugin is plugin:
                specs += checked_specs(implementation.function())
    except BaseException:
        manager.unregister(plugin)
        raise
    return specs


def failure_of(plugin: str, distribution: str, error: BaseException) -> PluginFailure:
    """Return the failure that an exception of a plugin amounts to: one line, with a remedy."""
    if isinstance(error, Refused):
        return PluginFailure(plugin, distribution, one_line(error), remedy=error.remedy)
    reason = one_line(f"{type(error).__name__}: {one_line(error)}")
    if isinstance(error, TypeError) and "BackendSpec.__init__() got an unexpected keyword" in reason:
        remedy = f"upgrade lsds (pip install -U lsds-tactile), or block it with LSDS_BLOCK_PLUGINS={plugin}"
        return PluginFailure(plugin, distribution, reason, remedy=remedy)
    return PluginFailure(plugin, distribution, reason, remedy=upgrade_or_block(plugin, distribution))


def upgrade_or_block(plugin: str, distribution: str) -> str:
    """Return the remedy for a plugin that is broken."""
    block = f"block it with LSDS_BLOCK_PLUGINS={plugin}"
    return block if distribution == NO_DISTRIBUTION else f"upgrade it (pip install -U {distribution}), or {block}"


def _require_known_hooks(manager: pluggy.PluginManager, plugin: object) -> None:
    callers = manager.get_hookcallers(plugin) or []
    for caller in callers:
        optional = all(impl.optionalhook for impl in caller.get_hookimpls() if impl.plugin is plugin)
        if not caller.has_spec() and not optional:
            raise Refused(f"unknown hook '{caller.name}'", did_you_mean(caller.name, [_HOOK]) or f"hooks: {_HOOK}")
    if callers:
        return
    bare = [name for name in dir(plugin) if name.startswith("lsds_") and callable(_attribute(plugin, name))]
    if _HOOK in bare:
        raise Refused(f"{_HOOK} is not marked as a hook", f"write @hookimpl above def {_HOOK}()")
    for name in bare:
        if hint := did_you_mean(name, [_HOOK], 0.8):
            raise Refused(f"'{name}' is not a hook", f"{hint} Mark it with @hookimpl")
    raise Refused("it has no hook", f"define @hookimpl def {_HOOK}() in the module that its entry point names")


def _attribute(plugin: object, name: str) -> Any:
    try:
        return getattr(plugin, name)
    except Exception:
        return None
