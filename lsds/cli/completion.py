"""`lsds completion`: shell completion of commands and options."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def completion(shell: str) -> None:
    """Print the completion script for a shell.

    It completes commands, options, config keys and backends after --set, faults, objects and learners.

    Takes: less than a second.

    Writes: nothing; the script goes to stdout.

    \b
    Examples:
      lsds completion bash > ~/.local/share/bash-completion/completions/lsds
      lsds completion zsh  > ~/.zfunc/_lsds
      lsds completion fish > ~/.config/fish/completions/lsds.fish
    """
    from lsds.cli import bash_completion
    from lsds.cli.main import cli

    bash_completion.use()
    found = get_completion_class(shell)
    if found is None:  # click.Choice admits only the shells that click supports.
        raise click.ClickException(f"no completion for {shell}")
    click.echo(found(cli, {}, "lsds", "_LSDS_COMPLETE").source())
