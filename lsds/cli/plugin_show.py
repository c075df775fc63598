"""`lsds plugins show`: one backend with its requirements, contract and options."""

from __future__ import annotations

from typing import Any

import click

from lsds.cli.output import plain, write_json
from lsds.cli.text_table import table
from lsds.contracts.kinds import KINDS
from lsds.errors import PluginNotFound
from lsds.registry.backends import Backend, did_you_mean, is_named
from lsds.registry.host import PluginHost


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("name")
@click.option(
    "--kind",
    type=click.Choice(list(KINDS)),
    metavar="KIND",
    default=None,
    help=f"Show only the backend of this kind: {', '.join(KINDS)}.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def show(name: str, kind: str | None, as_json: bool) -> None:
    """Show a backend: its requirements, the members of its contract, and its options.

    NAME is that of a backend, or DISTRIBUTION:NAME. Backends of several kinds may have the same name.

    Takes: a second.

    Writes: nothing; the result goes to stdout.

    \b
    Examples:
      lsds plugins show hand-e
      lsds plugins show fused --kind detector
      lsds plugins show lsds:mock-hand-e --json
    """
    from lsds.registry.describe import described

    host = PluginHost()
    found = [described(backend, host) for backend in _named(name, kind, host)]
    for backend in found:
        for option in backend["options"]:
            option["default"] = _json_or_text(option["default"])
    if as_json:
        write_json({"backends": found}, "-")
        return
    click.echo("\n\n".join(_text(backend) for backend in found))


def _named(name: str, kind: str | None, host: PluginHost) -> list[Backend]:
    """Return the backends of that name. Raises PluginNotFound with a suggestion."""
    of_kind = [backend for backend in host.backends if kind in (None, backend.spec.kind)]
    found = [backend for backend in of_kind if is_named(backend, name)]
    if found:
        return found
    hint = did_you_mean(name, {b.qualified_name if ":" in name else b.spec.name for b in of_kind})
    offered = f"{kind} '{name}'" if kind else f"'{name}'"
    raise PluginNotFound(f"no installed plugin offers {offered}; {hint}{' ' if hint else ''}lsds plugins lists all")


def _json_or_text(value: Any) -> Any:
    try:
        return plain(value)
    except Exception:
        return repr(value)


def _text(backend: dict[str, Any]) -> str:
    missing = backend["missing"]
    package = f"{backend['distribution']}[{backend['extra']}]" if backend["extra"] else ""
    install = f"; pip install '{package}'" if missing and package else ""
    needs = ", ".join(f"{name} (missing)" if name in missing else name for name in backend["requires"]) or "nothing"
    rows = [
        ("summary", backend["summary"] or backend["purpose"]),
        ("plugin", backend["plugin"]),
        ("factory", backend["factory"]),
        ("needs", needs + install),
        ("hardware", backend["hardware_verified"]),
        ("virtual time", "yes" if backend["virtual_time"] else "no"),
        ("contract", f"version {backend['contract']}: {', '.join(backend['members'])}"),
    ]
    lines = [f"{backend['kind']} '{backend['name']}' of {backend['distribution']}"]
    lines += [f"  {label:12}  {value}" for label, value in rows]
    if backend["options_problem"]:
        return "\n".join([*lines, f"  {'options':12}  {backend['options_problem']}"])
    if not backend["options"]:
        return "\n".join([*lines, f"  {'options':12}  none"])
    options = [_row(option) for option in backend["options"]]
    listed = table(options, ("OPTION", "TYPE", "DEFAULT", "UNIT", "DESCRIPTION"))
    return "\n".join([*lines, "", *(f"  {line}" for line in listed.splitlines())])


def _row(option: dict[str, Any]) -> tuple[str, ...]:
    from lsds.registry.containment import one_line

    default = "required" if option["required"] else one_line(repr(option["default"]))
    return option["name"], option["type"], default, option["unit"], option["description"]
