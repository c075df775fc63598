"""The plugin host of a command line, and the commands that plugins add to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from lsds.errors import ContractMismatch, PluginError

if TYPE_CHECKING:
    from lsds.registry.host import PluginHost


def host_of(ctx: click.Context) -> PluginHost:
    """Return the plugin host of this command line: `obj` if it was called with one, else that of the installed
    plugins."""
    from lsds.registry.host import PluginHost

    root = ctx.find_root()
    if not isinstance(root.obj, PluginHost):
        root.obj = PluginHost()
    host: PluginHost = root.obj
    return host


def command_summaries(ctx: click.Context, group: str = "") -> dict[str, str]:
    """Return the name and summary of every plugin command of a group, from the manifests alone."""
    return {
        b.spec.name: b.spec.summary for b in host_of(ctx).backends if b.spec.kind == "command" and b.spec.group == group
    }


def plugin_command(ctx: click.Context, name: str, group: str = "") -> click.Command | None:
    """Import a plugin's command of a group, "name" or "distribution:name"; None if no plugin offers it.

    Raises PluginConflict, PluginLoadError, ContractMismatch. During shell completion, returns None instead of raising.
    """
    host = host_of(ctx)
    if name.rpartition(":")[2] not in command_summaries(ctx, group):
        return None
    try:
        backend = host.find("command", name)
        command = host.imported(backend)
    except PluginError:
        if ctx.resilient_parsing:
            return None
        raise
    if not isinstance(command, click.Command):
        raise ContractMismatch(f"{backend}: '{backend.spec.factory}' is {type(command).__name__}, not a click command")
    return command
