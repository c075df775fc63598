"""`lsds record export`: recordings in the formats of other tools."""

from __future__ import annotations

from pathlib import Path

import click

from lsds.cli.output import table
from lsds.cli.progress import Progress

RECORDING = click.Path(dir_okay=False, path_type=Path)


@click.command()
@click.argument("recordings", type=RECORDING, nargs=-1, required=True)
@click.option("--to", "form", type=click.Choice(["parquet", "ros2"]), required=True, help="Format of the export.")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="New folder for the export.")
def export(recordings: tuple[Path, ...], form: str, out: Path) -> None:
    """Write a recording in the format of another tool.

    \b
    parquet   one table per topic: SI units in the metadata of the columns, arrays as lists
    ros2      a bag of CDR messages in an MCAP file, with metadata.yaml

    A minute of one finger takes some 20 s. Nothing is overwritten, and an export that fails leaves nothing behind.

    \b
    Examples:
      lsds record export run.mcap --to parquet --out tables
      lsds record export run.mcap --to ros2 --out bag
    """
    if len(recordings) > 1:
        raise click.UsageError(f"--to {form} takes one recording, not {len(recordings)}: export them one by one")
    from lsds.session.recording.export.parquet import to_parquet
    from lsds.session.recording.export.ros2 import to_ros2

    writer = {"parquet": to_parquet, "ros2": to_ros2}[form]
    with Progress(f"exporting {recordings[0]}") as progress:
        written = writer(recordings[0], out, progress.to)
    click.echo(table([(topic, str(rows)) for topic, rows in written.items()], ("topic", "messages")))
    click.echo(f"{out}: {sum(written.values())} messages")
