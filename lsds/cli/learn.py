"""`lsds learn`: record datasets, label them, train models. Its commands come from plugins."""

from __future__ import annotations

import click

from lsds.cli.plugged import command_summaries, plugin_command
from lsds.cli.suggesting_group import SuggestingGroup

GROUP = "learn"
"""Group of the plugin commands that are listed here."""


class LearnGroup(SuggestingGroup):
    """The commands of the group that installed plugins offer; one is imported when it is used."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return their names."""
        return list(command_summaries(ctx, GROUP))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import one. Raises PluginConflict, PluginLoadError, ContractMismatch."""
        return plugin_command(ctx, cmd_name, GROUP)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands from their manifests without importing any."""
        with formatter.section("Commands"):
            offered = list(command_summaries(ctx, GROUP).items())
            formatter.write_dl(offered or [("none", "no installed plugin offers a command for learning")])


@click.group(cls=LearnGroup, context_settings={"help_option_names": ["-h", "--help"]})
def learn() -> None:
    """Record datasets, label slip by eye, and train models.

    \b
    Examples:
      lsds learn collect detection --out try --quick
      lsds learn label clip.avi --labeller A
      lsds learn train fused --data try --out mine.onnx
    """
