"""`lsds new`: write the scaffold of a plugin."""

from __future__ import annotations

from pathlib import Path

import click

from lsds.cli.scaffold.plan import PLANS


@click.command(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.argument("kind", type=click.Choice(list(PLANS)), metavar="KIND")
@click.argument("name")
@click.option("--out", type=click.Path(path_type=Path), default=None, help="Folder to write; default: ./DISTRIBUTION.")
@click.option("--distribution", default="", metavar="NAME", help="Name of the distribution; default: lsds-NAME.")
@click.option(
    "--force", is_flag=True, help="Write into a folder that is not empty; files of the same name are replaced."
)
def new(kind: str, name: str, out: Path | None, distribution: str, force: bool) -> None:
    """Write a complete plugin distribution to start from: code, options, conformance tests, packaging.

    KIND is gripper, arm, sensor, pose_source, tracker, detector, estimator, controller, job, fault, wire_mock, study or
    command. NAME is that of the backend in a config. A device comes as a driver behind an interface, and as a mock that
    joins the simulated cell. Needs Jinja: pip install 'lsds-tactile[new]'. The exit code is 2 for a wrong name, and 5
    if a file cannot be written.

    Takes: a second.

    Writes: the folder ./DISTRIBUTION, or that of --out.

    \b
    Examples:
      lsds new gripper acme-2f
      lsds new sensor acme-skin --out skin
      lsds new detector acme-area --distribution acme-area
      lsds new controller acme-pid --force
    """
    from lsds.cli.scaffold.names import names_of
    from lsds.cli.scaffold.write import next_commands, write

    names = names_of(kind, name, distribution)
    folder = Path(names.distribution) if out is None else out
    written = write(names, folder, force=force)
    for path in written:
        click.echo(path)
    for warning in _claims(kind, name):
        click.echo(f"warning: {warning}", err=True)
    click.echo("\nnext:")
    for command in next_commands(names, folder):
        click.echo(f"  {command}")


def _claims(kind: str, name: str) -> list[str]:
    """Return a warning for each installed distribution that offers a backend of that kind and name."""
    from lsds.registry.host import PluginHost

    remedy = "a config then has to name DISTRIBUTION:NAME"
    return [
        f"{kind} '{name}' is offered by {backend.distribution} already; {remedy}"
        for backend in PluginHost().backends
        if (backend.spec.kind, backend.spec.name) == (kind, name)
    ]
