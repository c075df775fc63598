"""`lsds study`: run a study of an installed plugin. One subcommand for each study."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.shell_completion import CompletionItem

from lsds.cli.plugged import command_summaries, host_of, plugin_command
from lsds.cli.suggesting_group import SuggestingGroup
from lsds.cli.threads import one_thread
from lsds.errors import PluginError

if TYPE_CHECKING:
    from pydantic import BaseModel

    from lsds.registry.backends import Backend
    from lsds.registry.host import PluginHost

GROUP = "study"
"""Group of the plugin commands that are listed among the studies."""
_HELP = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


class StudyGroup(SuggestingGroup):
    """Subcommands made from the installed studies, with flags made from each study's options model."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all studies, and of the commands that are among them."""
        return [*host_of(ctx).names("study"), *command_summaries(ctx, GROUP)]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of one study. Raises PluginConflict, PluginLoadError."""
        host = host_of(ctx)
        if cmd_name.rpartition(":")[2] not in host.names("study"):
            return plugin_command(ctx, cmd_name, GROUP)
        # The options may import numpy, after which its number of threads can no longer be set.
        one_thread()
        try:
            return _command(host, host.find("study", cmd_name))
        except PluginError:
            if ctx.resilient_parsing:
                return None
            raise

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the studies from their manifests without importing any."""
        with formatter.section("Studies"):
            formatter.write_dl(_summaries(ctx) or [("none", "no installed plugin offers a study")])

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Complete names from the manifests without importing any study's options."""
        if incomplete.startswith("-"):
            return click.Command.shell_complete(self, ctx, incomplete)
        return [CompletionItem(name, help=text) for name, text in _summaries(ctx) if name.startswith(incomplete)]


def _summaries(ctx: click.Context) -> list[tuple[str, str]]:
    studies = [(b.spec.name, b.spec.summary) for b in host_of(ctx).backends if b.spec.kind == "study"]
    return [*studies, *command_summaries(ctx, GROUP).items()]


@click.group(cls=StudyGroup, context_settings=_HELP, invoke_without_command=True)
@click.pass_context
def study(ctx: click.Context) -> None:
    """Run a study: measure speed and accuracy, score models, look for failures, repeat the paper.

    A study prints a table and writes NAME.png. Each option can be given as a flag or with --set KEY=VALUE.

    \b
    Examples:
      lsds study                               list the studies
      lsds study gel --help                    show the options of a study
      lsds study gel --scene sphere --csv gel.csv
      lsds study gel --set repeats=1 --set 'scenes=["sphere"]'
    """
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


def _command(host: PluginHost, backend: Backend) -> click.Command:
    from lsds.cli.study_command import study_command

    model = host.options_model(backend)
    name = backend.spec.name
    text = "" if model is None else _own_doc(model)
    text = text or backend.spec.summary[:1].upper() + backend.spec.summary[1:]
    if "Examples:" not in text:
        text += f"\n\n\b\nExamples:\n  lsds study {name}\n  lsds study {name} --seed 1 --json result.json"
    command = study_command(
        name, model, text, study=backend.qualified_name, picture=Path(f"{name}.png"), positional=_arguments(model)
    )
    command.context_settings = _HELP
    return command


def _arguments(model: type[BaseModel] | None) -> tuple[str, ...]:
    """Return the options that are arguments: those that their model marks so."""
    fields = {} if model is None else model.model_fields
    return tuple(
        name
        for name, field in fields.items()
        if isinstance(field.json_schema_extra, dict) and field.json_schema_extra.get("argument")
    )


def _own_doc(model: type) -> str:
    from inspect import cleandoc

    return cleandoc(model.__dict__.get("__doc__") or "")
