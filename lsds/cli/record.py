"""`lsds record`: look at recordings, report, cut and repair them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from lsds.cli.output import json_option, require_writable, table, write_json

RECORDING = click.Path(dir_okay=False, path_type=Path)


@click.group()
def record() -> None:
    """Look at recordings of runs, report, cut and repair them.

    \b
    Examples:
      lsds run --record run.mcap          make one
      lsds record info run.mcap           what is in it?
      lsds record report run.mcap --out run.html
      lsds record cut run.mcap --from 3 --to 5 --out short.mcap
      lsds record repair run.mcap --out whole.mcap
    """


@record.command()
@click.argument("recording", type=RECORDING)
@json_option
def info(recording: Path, json_file: str | None) -> None:
    """State what a recording holds, and whether it is whole.

    It reads the whole file, some 200 MB a second. The exit code is 0, and 5 for a file that is no recording.

    \b
    Examples:
      lsds record info run.mcap
      lsds record info run.mcap --json -
    """
    require_writable(json_file)
    from lsds.session.recording.files import contents

    found = contents(recording)
    if json_file != "-":
        click.echo(_table(found))
    if json_file is not None:
        write_json(found, json_file)


@record.command()
@click.argument("recording", type=RECORDING)
@click.option("--out", type=RECORDING, required=True, metavar="F.html", help="New file for the page.")
def report(recording: Path, out: Path) -> None:
    """Write one page of a recorded run: plots over one time axis, tactile images, events and summary.

    The page opens from disk in a browser and loads nothing from the network. A damaged recording gives a page of what
    can be read, with a note.

    \b
    Examples:
      lsds record report run.mcap --out run.html
    """
    from lsds.session.recording.report.page import write_report

    damage = write_report(recording, out)
    click.echo(f"report: {out}")
    if damage:
        click.echo(f"warning: the report is incomplete: {damage}", err=True)


@record.command()
@click.argument("recording", type=RECORDING)
@click.option("--from", "start_s", type=float, default=0.0, show_default=True, help="Begin of the part, s.")
@click.option("--to", "end_s", type=float, default=None, help="End of the part, s; default: that of the recording.")
@click.option("--out", type=RECORDING, required=True, help="New file for the part.")
def cut(recording: Path, start_s: float, end_s: float | None, out: Path) -> None:
    """Copy a part of a recording to a new file.

    Times are seconds since the recording began. A part that begins later than the reference of the gel can be looked
    at, but a replay takes its first frames as the reference.

    \b
    Examples:
      lsds record cut run.mcap --from 3 --to 5 --out short.mcap
    """
    from lsds.session.recording.files import cut as cut_file

    written = cut_file(recording, out, start_s, end_s)
    click.echo(f"{out}: {written} messages")


@record.command()
@click.argument("recording", type=RECORDING)
@click.option("--out", type=RECORDING, required=True, help="New file for what can be read.")
def repair(recording: Path, out: Path) -> None:
    """Copy what can be read of a damaged recording to a new, whole file.

    A run that was killed leaves a file without an end, which some viewers refuse. The damaged file is left as it is.

    \b
    Examples:
      lsds record repair run.mcap --out whole.mcap
    """
    from lsds.session.recording.files import repair as repair_file

    written, damage = repair_file(recording, out)
    click.echo(f"{out}: {written} messages; {recording} is {damage or 'whole'}")


def _table(found: dict[str, Any]) -> str:
    rows = [
        ("recorded with", f"lsds {found['lsds']}, {found['started']}"),
        ("length", f"{found['duration_s']:.2f} s, {found['bytes'] / 1e6:.1f} MB"),
        ("figures are", "simulated" if found["simulated"] else "measured"),
        ("fingers", ", ".join(found["fingers"])),
        ("state", found["damage"] or "whole"),
    ]
    topics = [
        (name, str(own["messages"]), f"{own['rate_hz']:.1f} Hz", f"{own['bytes'] / 1e6:.2f} MB", own["schema"])
        for name, own in found["topics"].items()
    ]
    heads = ("topic", "messages", "rate", "size", "type")
    return table(rows, ("recording", "")) + "\n\n" + table(topics, heads)
