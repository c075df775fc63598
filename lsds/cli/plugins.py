"""`lsds plugins`: installed backends, and plugins that failed to load."""

from __future__ import annotations

from typing import Any

import click

from lsds.cli.output import json_flag, require_known, write_json
from lsds.cli.plugin_show import show
from lsds.cli.text_table import table
from lsds.contracts.kinds import KINDS
from lsds.registry.backends import OWN_DISTRIBUTION, Backend
from lsds.registry.containment import one_line
from lsds.registry.host import PluginHost

NOT_VERIFIED = "not verified"
"""Text for a backend without a test on its hardware."""
GROUPS: dict[str, tuple[str, ...]] = {
    "Devices": ("sensor", "gripper", "arm", "pose_source", "cell"),
    "Algorithms": ("tracker", "detector", "estimator", "controller", "job"),
    "Commands": ("command", "study", "learner"),
    "Test equipment": ("wire_mock", "fault"),
}
"""Kinds in the order in which they are listed, by title."""
SHORTENED = ("Commands", "Test equipment")
"""Groups of which only the number is listed: separate commands list them, and they would hide the others."""
COLUMNS = {
    "kind": "KIND",
    "name": "NAME",
    "distribution": "DISTRIBUTION",
    "status": "STATUS",
    "hardware_verified": "HARDWARE",
    "summary": "SUMMARY",
}
"""Columns of the tables with their heads."""
USUAL = {"distribution": OWN_DISTRIBUTION, "status": "ready", "hardware_verified": NOT_VERIFIED}
"""Values that are not worth a column if all backends have them."""


class PluginsGroup(click.Group):
    """Lists the backends if it is called without a command."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command; the error for an unknown one suggests the nearest name. Raises click.UsageError."""
        require_known(ctx, args, self.list_commands(ctx))
        return super().resolve_command(ctx, args)


@click.group(cls=PluginsGroup, invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--kind",
    type=click.Choice(list(KINDS)),
    metavar="KIND",
    default=None,
    help=f"List only backends of this kind: {', '.join(KINDS)}.",
)
@click.option("--all", "everything", is_flag=True, help="List commands, studies, wire mocks and faults as well.")
@json_flag
@click.pass_context
def plugins(ctx: click.Context, kind: str | None, everything: bool, json_file: str | None) -> None:
    """List the installed backends, and the plugins that failed to load with the reason.

    Devices and algorithms first; of commands and test equipment the number.

    Takes: a second.

    Writes: nothing, except the file of --json.

    \b
    Examples:
      lsds plugins
      lsds plugins --kind gripper
      lsds plugins --all
      lsds plugins --json backends.json
      lsds plugins show mock-hand-e
      LSDS_BLOCK_PLUGINS=acme-gripper lsds plugins
    """
    if ctx.invoked_subcommand is None:
        _list(kind, json_file, everything=everything)


plugins.add_command(show)


def _list(kind: str | None, json_file: str | None, *, everything: bool) -> None:
    host = PluginHost()
    backends = [_row(b, host) for b in host.backends if kind in (None, b.spec.kind)]
    failures = [
        {key: getattr(f, key) for key in ("plugin", "distribution", "reason", "remedy", "blocked")}
        for f in host.failures
    ]
    notes = [{key: getattr(note, key) for key in ("plugin", "distribution", "text")} for note in host.notes]
    if json_file is not None:
        write_json({"backends": backends, "failures": failures, "notes": notes}, json_file)
        return
    if backends:
        click.echo("\n\n".join(_groups(backends, everything=everything or kind is not None)))
    else:
        click.echo("no backend is installed" + (f" of kind {kind}" if kind else ""))
    for failure in host.failures:
        state = "blocked" if failure.blocked else f"failed to load: {failure.reason}; {failure.remedy}"
        click.echo(f"plugin {failure.plugin} ({failure.distribution}): {state}")
    for note in host.notes:
        click.echo(f"plugin {note}")


def _groups(backends: list[dict[str, Any]], *, everything: bool) -> list[str]:
    """Return a table of each group of kinds; of the last groups only the number, unless everything is wanted."""
    parts = []
    for title, kinds in GROUPS.items():
        rows = sorted(
            (row for row in backends if row["kind"] in kinds), key=lambda row: (kinds.index(row["kind"]), row["name"])
        )
        if rows and not everything and title in SHORTENED:
            parts.append(f"{title}: {len(rows)} (lsds plugins --all)")
        elif rows:
            columns = [name for name in COLUMNS if any(row[name] != USUAL.get(name) for row in backends)]
            cells = [tuple(str(row[column]) for column in columns) for row in rows]
            parts.append(f"{title}\n\n" + table(cells, tuple(COLUMNS[column] for column in columns)))
    return parts


def _row(backend: Backend, host: PluginHost) -> dict[str, Any]:
    missing = host.missing_requirements(backend)
    return {
        "kind": backend.spec.kind,
        "name": backend.spec.name,
        "distribution": backend.distribution,
        "plugin": backend.plugin,
        "summary": one_line(backend.spec.summary),
        "status": f"needs {', '.join(missing)}" if missing else "ready",
        "missing": list(missing),
        "extra": backend.spec.extra,
        "virtual_time": backend.spec.virtual_time,
        "hardware_verified": backend.spec.hardware_verified or NOT_VERIFIED,
    }
