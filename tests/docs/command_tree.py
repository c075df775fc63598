"""Every command of the installed command line."""

from __future__ import annotations

import click


def commands(command, path, parent=None):
    """Yield every command of the tree with its path."""
    context = click.Context(command, info_name=path[-1], parent=parent)
    yield path, command
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            found = command.get_command(context, name)
            if found is not None:
                yield from commands(found, (*path, name), context)
