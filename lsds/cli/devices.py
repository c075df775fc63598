"""`lsds devices`: connected cameras and serial ports, and what each backend is missing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from lsds.cli.output import json_flag, write_json
from lsds.cli.text_table import table
from lsds.contracts import DEVICE_KINDS
from lsds.registry.host import PluginHost

CAMERAS = Path("/dev/v4l/by-id")
SERIAL_PORTS = Path("/dev/serial/by-id")
_FINGERTIPS = ("gelsight", "digit")
"""Parts of the USB names of tactile cameras."""


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@json_flag
def devices(json_file: str | None) -> None:
    """List cameras and serial ports by their stable names, and what each device backend is missing.

    Reads names only: no device is opened and nothing moves.

    Takes: a second.

    Writes: nothing, except the file of --json.

    \b
    Examples:
      lsds devices
      lsds devices --json -
    """
    host = PluginHost()
    cameras, ports = links(CAMERAS), links(SERIAL_PORTS)
    backends = [
        {
            "kind": backend.spec.kind,
            "name": backend.spec.name,
            "missing": list(host.missing_requirements(backend)),
            "simulated": backend.spec.in_cell,
        }
        for backend in host.backends
        if backend.spec.kind in DEVICE_KINDS
    ]
    if json_file is not None:
        write_json({"cameras": cameras, "serial_ports": ports, "backends": backends}, json_file)
        return
    _show("cameras", cameras, CAMERAS)
    _show("serial ports", ports, SERIAL_PORTS)
    rows = [(str(b["kind"]), str(b["name"]), _needs(b["missing"], bool(b["simulated"]))) for b in backends]
    click.echo(table(rows, ("KIND", "BACKEND", "STATUS")) if rows else "no device backend is installed")


def links(folder: Path) -> list[dict[str, Any]]:
    """Return the links udev keeps in a folder: a stable name, the device it stands for, whether it is a fingertip."""
    try:
        entries = sorted(folder.iterdir())
    except OSError:
        return []
    return [
        {
            "path": str(entry),
            "device": str(entry.resolve()),
            "tactile": any(maker in entry.name.lower() for maker in _FINGERTIPS),
        }
        for entry in entries
    ]


def _show(title: str, found: list[dict[str, Any]], folder: Path) -> None:
    if not found:
        click.echo(f"{title}: none ({folder} has no entries)")
        return
    click.echo(f"{title}:")
    for link in found:
        click.echo(f"  {link['path']} -> {link['device']}" + ("  (tactile fingertip)" if link["tactile"] else ""))


def _needs(missing: Any, simulated: bool) -> str:
    if missing:
        return f"needs {', '.join(missing)}"
    return "ready (simulated)" if simulated else "ready"
