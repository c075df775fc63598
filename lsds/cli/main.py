"""`lsds`: the entry point, which imports a command only when it is called."""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Sequence
from typing import NoReturn

import click
from click.shell_completion import CompletionItem

from lsds import __version__
from lsds.cli.plugged import command_summaries, plugin_command
from lsds.cli.signals import Terminated, terminable
from lsds.errors import LsdsError

COMMANDS: dict[str, tuple[str, str]] = {
    "run": ("lsds.cli.run:run", "Run the closed loop: grasp, lift, hold, on hardware or in the simulated cell."),
    "track": ("lsds.cli.track:track", "Track slip in recordings. No device moves."),
    "record": ("lsds.cli.record:record", "Film a sensor; look at recordings, cut, repair, report and export them."),
    "replay": ("lsds.cli.replay:replay", "Run the algorithms again on a recorded run, and compare."),
    "study": ("lsds.cli.study:study", "Measure speed and accuracy, score models, look for failures."),
    "learn": ("lsds.cli.learn:learn", "Record datasets, label slip by eye, and train models."),
    "mock": ("lsds.cli.mock:mock", "Serve a mock device on its own wire protocol."),
    "calibrate": ("lsds.cli.calibrate:calibrate", "Calibrate a camera, or slip and load on your own gel."),
    "plugins": ("lsds.cli.plugins:plugins", "List the installed backends and the plugins that failed to load."),
    "check": ("lsds.cli.check:check", "Check that a backend keeps the contract of its kind."),
    "new": ("lsds.cli.new:new", "Write a plugin to start from: code, options, tests, packaging."),
    "config": ("lsds.cli.config:config", "Write a config to start from, check one, or print the schema."),
    "devices": ("lsds.cli.devices:devices", "List cameras and serial ports, and what each backend is missing."),
    "completion": ("lsds.cli.completion:completion", "Print a shell completion script."),
}
"""Built-in commands: name -> (module:attribute, the summary in `lsds --help`)."""
FORMER = {
    "chart": "study",
    "choose": "study choose",
    "collect": "learn collect",
    "evaluate": "study",
    "label": "learn label",
    "reproduce": "study reproduce",
    "schema": "config schema' or 'lsds config example",
    "search": "study search",
    "train": "learn train",
}
"""Names of the release before, each with the present one; they are removed in lsds 0.3."""


class LazyGroup(click.Group):
    """A command group with a table of names and summaries; a command is imported when it is used.

    Plugins add commands (kind `command`). Their manifests are read only if all names are needed, or if a name is
    not built in. A built-in command takes precedence over a plugin's command of the same name.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return all names: built-in commands in the order of the table, then those of plugins."""
        return list(_summaries(ctx))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command. Raises click.ClickException or PluginError if it cannot be imported."""
        if cmd_name not in COMMANDS:
            return plugin_command(ctx, cmd_name)
        module, _, attribute = COMMANDS[cmd_name][0].partition(":")
        try:
            command = getattr(importlib.import_module(module), attribute)
        except ImportError as error:
            if (ctx.find_root().params or {}).get("debug"):
                raise
            raise click.ClickException(f"the command '{cmd_name}' cannot be loaded: {error}") from error
        if not isinstance(command, click.Command):
            raise click.ClickException(f"'{COMMANDS[cmd_name][0]}' is not a command")
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands without importing any."""
        with formatter.section("Commands"):
            formatter.write_dl(list(_summaries(ctx).items()))

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Complete command names without importing any command, so that Tab responds at once."""
        if incomplete.startswith("-"):
            return click.Command.shell_complete(self, ctx, incomplete)
        found = [item for item in _summaries(ctx).items() if item[0].startswith(incomplete)]
        return [CompletionItem(name, help=summary) for name, summary in found]

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command; the error for an unknown one suggests the nearest name. Raises click.UsageError."""
        if args and args[0] in FORMER and args[0] not in _summaries(ctx):
            raise click.UsageError(f"'lsds {args[0]}' is now 'lsds {FORMER[args[0]]}'", ctx)
        if args and args[0] not in COMMANDS and ":" not in args[0]:
            from lsds.cli.output import require_known

            require_known(ctx, args, _summaries(ctx))
        return super().resolve_command(ctx, args)


def _summaries(ctx: click.Context) -> dict[str, str]:
    """Return the name and summary of every command."""
    own = {name: summary for name, (_, summary) in COMMANDS.items()}
    return own | {name: summary for name, summary in command_summaries(ctx).items() if name not in own}


@click.command(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.option("--debug", is_flag=True, help="Show the traceback of an error.")
@click.version_option(__version__, prog_name="lsds")
def cli(debug: bool) -> None:
    """Detect slip with a camera-based tactile fingertip and close the gripper just enough.

    \b
    Examples:
      lsds run                          run the simulated cell, closed loop
      lsds run rig.toml --set seed=7    run your own cell
      lsds plugins                      list what is installed
      lsds config example > rig.toml    write a config to start from
    """


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code, see `run_command`."""
    return run_command(cli, "lsds", arguments)


def program() -> NoReturn:
    """Run the command line and end the process, whatever a plugin has left running."""
    code = main()
    from lsds.cli.ending import end_process

    end_process(code)


def run_command(command: click.Command, name: str, arguments: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit code.

    An `LsdsError` is printed as one message on stderr and gives the exit code of its class; `--debug` shows the
    traceback instead. A missing library that an extra of lsds installs is reported the same way. An interrupt gives
    130, SIGTERM 143, a closed output pipe 141, as a shell expects.
    """
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    if "_LSDS_COMPLETE" in os.environ:
        from lsds.cli import bash_completion

        bash_completion.use()
    try:
        with terminable():
            result = command.main(args=arguments, prog_name=name, standalone_mode=False)
            sys.stdout.flush()
    except click.exceptions.Abort as abort:
        return _interrupted(abort.__cause__)
    except KeyboardInterrupt as error:
        return _interrupted(error)
    except click.exceptions.Exit as request:
        return request.exit_code
    except click.ClickException as error:
        error.show()
        return error.exit_code
    except BrokenPipeError:
        # Python flushes stdout once more at exit; point it at a stream that can still be written.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141
    except LsdsError as error:
        if "--debug" in arguments:
            raise
        return _explain(error)
    except ModuleNotFoundError as error:
        from lsds.support.extras import explained

        missing = None if "--debug" in arguments else explained(error)
        if missing is None:
            raise
        return _explain(missing)
    except ExceptionGroup as group:
        if "--debug" in arguments or group.split(LsdsError)[1] is not None:
            raise
        click.echo(f"error: {group.message}", err=True)
        return max(_explain(error) for error in group.exceptions if isinstance(error, LsdsError))
    return result if isinstance(result, int) else 0


def _interrupted(error: BaseException | None) -> int:
    click.echo("terminated" if isinstance(error, Terminated) else "interrupted", err=True)
    for note in getattr(error, "__notes__", ()):
        click.echo(f"  {note}", err=True)
    return error.exit_code if isinstance(error, Terminated) else 130


def _explain(error: LsdsError) -> int:
    click.echo(f"error: {error}", err=True)
    for note in getattr(error, "__notes__", ()):
        click.echo(f"  {note}", err=True)
    return error.exit_code


if __name__ == "__main__":
    program()
