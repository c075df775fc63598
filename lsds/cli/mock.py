"""`lsds mock`: serve a mock device on its wire protocol. One subcommand for each installed wire mock."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

import click

from lsds.cli.plugged import host_of
from lsds.cli.set_option import set_option
from lsds.cli.suggesting_group import SuggestingGroup

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo

    from lsds.registry.backends import Backend
    from lsds.registry.host import PluginHost

LONGEST_CHOICE = 50
"""Choices of more characters in all are listed in the text of an option, where they wrap."""
WRITES = "nothing but the link of --pty and sockets; the addresses go to stdout."
_HELP = {"help_option_names": ["-h", "--help"], "max_content_width": 100}


class MockGroup(SuggestingGroup):
    """Subcommands made from the installed wire mocks, with flags made from each mock's options model."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all wire mocks, and `rig`."""
        return [*host_of(ctx).names("wire_mock"), "rig"]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of one mock. Raises PluginConflict, PluginLoadError."""
        if cmd_name == "rig":
            return rig
        host = host_of(ctx)
        if cmd_name.rpartition(":")[2] not in host.names("wire_mock"):
            return None
        return _command(host, host.find("wire_mock", cmd_name))

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the mocks from their manifests without importing any."""
        rows = [(b.spec.name, b.spec.summary) for b in host_of(ctx).backends if b.spec.kind == "wire_mock"]
        with formatter.section("Mocks"):
            formatter.write_dl([*rows, ("rig", "all mocks of a rig's [cell.wire], sharing one plant")])


@click.group(cls=MockGroup, context_settings=_HELP)
def mock() -> None:
    """Serve a mock device on its own wire protocol, for the real drivers and any other client.

    Mocks listen on loopback addresses only. Ctrl-C stops the command. With --control, for tests, it also reads faults
    and requests from standard input, one JSON object per line, and stops when the input ends.

    \b
    Examples:
      lsds mock hand-e --pty hand-e.tty       a gripper on a pseudo-terminal
      lsds mock ur5e --host 127.0.0.2         an arm, all its ports
      lsds mock gelsight-mini --port 8080     a fingertip as MJPEG
      lsds mock hand-e --fault kind=drop,probability=0.05
      lsds mock rig examples/rigs/wire.toml   all mocks of a rig on one plant
    """


@click.command(context_settings=_HELP)
@click.argument("config", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@set_option("Override one option; repeatable.")
@click.option("--json", "as_json", is_flag=True, help="Print the addresses as one line of JSON.")
def rig(config: Path, overrides: tuple[str, ...], as_json: bool) -> None:
    """Serve all mocks of a rig until Ctrl-C, each in its own process, with one shared plant.

    The mocks are those of the config's cell, [cell] backend = "wire". `lsds run` with the same file connects to them.

    Takes: until Ctrl-C is pressed.

    Writes: nothing; the addresses go to stdout.

    \b
    Examples:
      lsds mock rig examples/rigs/wire.toml
      lsds mock rig examples/rigs/wire.toml --set cell.wire.plant.mass_kg=0.5
    """
    from lsds.cli.mock_session import serve_rig

    serve_rig(config, overrides, as_json=as_json)


def _command(host: PluginHost, backend: Backend) -> click.Command:
    model = host.options_model(backend)
    fields = {} if model is None else model.model_fields
    parameters: list[click.Parameter] = [_parameter(name, field) for name, field in fields.items() if name != "faults"]
    if "faults" in fields:
        parameters.append(
            click.Option(
                ["--fault", "faults"],
                multiple=True,
                metavar="kind=KIND[,KEY=VALUE...]",
                help="Inject a fault; repeatable. Keys: face, probability, after_s, for_s, count, delay_ms, code, "
                "severity, when, nth, name.",
            )
        )
    parameters += [
        click.Option(
            ["--seed"], type=click.IntRange(min=0), default=0, show_default=True, help="Seed of faults and noise."
        ),
        click.Option(["--control"], is_flag=True, help="Read requests from standard input; stop when it ends."),
        click.Option(["--json", "as_json"], is_flag=True, help="Print the addresses as one line of JSON."),
    ]

    def callback(seed: int, control: bool, as_json: bool, **given: Any) -> None:
        from lsds.cli.mock_session import serve

        serve(host, backend, given, seed=seed, control=control, as_json=as_json)

    text = f"{backend.spec.summary}\n\nTakes: until Ctrl-C is pressed.\n\nWrites: {WRITES}"
    return click.Command(backend.spec.name, params=parameters, callback=callback, help=text, context_settings=_HELP)


def _parameter(name: str, field: FieldInfo) -> click.Parameter:
    """Return the flag (for a required field, the argument) of one option. The model validates its text."""
    if field.is_required():
        return click.Argument([name])
    default = field.get_default(call_default_factory=True)
    if isinstance(default, bool):
        flag = name.replace("_", "-")
        return click.Option([f"--{flag}/--no-{flag}", name], default=None, help=field.description)
    shown = f"{field.description or ''}  [default: {default}]" if default not in (None, "") else field.description
    words = get_args(field.annotation) if get_origin(field.annotation) is Literal else ()
    if words and all(isinstance(word, str) for word in words):
        choices = click.Choice(words)
        listed = None if len("|".join(words)) <= LONGEST_CHOICE else "NAME"
        shown = shown if listed is None else f"{shown}  [{', '.join(words)}]"
        return click.Option(
            [f"--{name.replace('_', '-')}", name], default=None, type=choices, metavar=listed, help=shown
        )
    metavar = "N" if isinstance(default, int | float) else "TEXT"
    return click.Option([f"--{name.replace('_', '-')}", name], default=None, metavar=metavar, help=shown)
