"""The plugin host of a command line, and the commands that plugins add to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from lsds.errors import ContractMismatch, PluginError

if TYPE_CHECKING:
    from lsds.plugins.host import PluginHost


def host_of(ctx: click.Context) -> PluginHost:
    """Return the host that this command line uses: the one it was called with (`obj`), or one of what is installed."""
    from lsds.plugins.host import PluginHost

    root = ctx.find_root()
    if not isinstance(root.obj, PluginHost):
        root.obj = PluginHost()
    host: PluginHost = root.obj
    return host


def command_summaries(ctx: click.Context) -> dict[str, str]:
    """Return name and summary of every command of a plugin, from the manifests alone."""
    return {b.spec.name: b.spec.summary for b in host_of(ctx).backends if b.spec.kind == "command"}


def plugin_command(ctx: click.Context, name: str) -> click.Command | None:
    """Import a plugin's command, "name" or "distribution:name"; None where there is none of that name.

    Raises PluginConflict, PluginLoadError, ContractMismatch; while a shell completes, there is then no such command.
    """
    host = host_of(ctx)
    if name.rpartition(":")[2] not in host.names("command"):
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
