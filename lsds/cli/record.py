"""`lsds record`: look at recordings, cut, repair, report and export them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lsds.cli.finite import FiniteRange
from lsds.cli.output import json_option, require_writable, write_json
from lsds.cli.record_export import export
from lsds.cli.set_option import set_option
from lsds.cli.text_table import table
from lsds.cli.threads import one_thread

if TYPE_CHECKING:
    from lsds.session.recording.writer import Images

RECORDING = click.Path(dir_okay=False, path_type=Path)


@click.group()
def record() -> None:
    """Film a sensor; look at recordings, cut, repair, report and export them.

    \b
    Examples:
      lsds run --record run.mcap          record a run
      lsds record film rig.toml --seconds 10 --out gel.mcap
      lsds record info run.mcap           what is in it?
      lsds record report run.mcap --out run.html
      lsds record cut run.mcap --from 3 --to 5 --out short.mcap
      lsds record repair run.mcap --out whole.mcap
      lsds record export run.mcap --to parquet --out tables
    """


record.add_command(export)


@record.command()
@click.argument("config", required=False, type=click.Path(dir_okay=False, path_type=Path))
@set_option("Override one option; repeatable.")
@click.option("--seconds", type=FiniteRange(min=0.1), default=10.0, show_default=True, help="Length of the film, s.")
@click.option("--out", type=RECORDING, required=True, help="New file for the film.")
@click.option(
    "--images",
    type=click.Choice(["lossless", "jpeg"]),
    default="lossless",
    show_default=True,
    help="How images are stored; jpeg takes a tenth of the space.",
)
@click.option("--view", default=None, metavar="WHERE", help="Show it live, as lsds run --view.")
def film(
    config: Path | None, overrides: tuple[str, ...], seconds: float, out: Path, images: Images, view: str | None
) -> None:
    """Film the sensors of a rig for some seconds; nothing moves.

    Every frame is kept with its markers and answers. Ctrl-C ends the film earlier and keeps it. The commands that take
    a video (lsds track, label, calibrate) take the film as well.

    Takes: as long as --seconds, or until Ctrl-C.

    Writes: the new recording of --out.

    \b
    Examples:
      lsds record film rig.toml --seconds 10 --out gel.mcap
      lsds record film --out gel.mcap --view terminal
    """
    one_thread()
    from lsds.session.film import film as film_sensors

    session = film_sensors(config, overrides, seconds, out, images=images, view=view)
    recorded = session.summary["recording"]
    click.echo(
        f"{recorded['file']}: {session.summary['cycles']} frames with an answer, {recorded['messages']} messages"
    )
    if recorded["problem"]:
        click.echo(f"warning: recording {recorded['file']}: {recorded['problem']}", err=True)
    if session.fault is not None:
        raise session.fault


@record.command()
@click.argument("recording", type=RECORDING)
@json_option
def info(recording: Path, json_file: str | None) -> None:
    """State what a recording holds, and whether it is whole.

    It reads the whole file. The exit code is 0, and 5 for a file that is no recording.

    Takes: a second per recorded minute.

    Writes: nothing, except the file of --json.

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

    Takes: a few seconds per recorded minute.

    Writes: the new page of --out.

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

    Takes: a few seconds per recorded minute.

    Writes: the new recording of --out.

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

    Takes: a few seconds per recorded minute.

    Writes: the new recording of --out.

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
        ("length", f"{found['duration_s']:.2f} s from {found['begins_s']:.2f} s on, {found['bytes'] / 1e6:.1f} MB"),
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
