"""A command group whose commands come from plugins: an unknown name gets the nearest one as a suggestion."""

from __future__ import annotations

import click

from lsds.cli.output import require_known


class SuggestingGroup(click.Group):
    """A group that may also be asked for "distribution:name"."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command; the error for an unknown one suggests the nearest name. Raises click.UsageError."""
        if args and ":" not in args[0]:
            require_known(ctx, args, self.list_commands(ctx))
        return super().resolve_command(ctx, args)
