"""`lsds record export`: recordings in the formats of other tools."""

from __future__ import annotations

from pathlib import Path

import click

from lsds.cli.progress import Progress
from lsds.cli.text_table import table

RECORDING = click.Path(dir_okay=False, path_type=Path)


@click.command()
@click.argument("recordings", type=RECORDING, nargs=-1, required=True)
@click.option(
    "--to", "form", type=click.Choice(["parquet", "ros2", "lerobot"]), required=True, help="Format of the export."
)
@click.option("--out", type=click.Path(path_type=Path), required=True, help="New folder for the export.")
@click.option("--task", default=None, help="lerobot: text of the task; default: grasp, lift and hold an object.")
@click.option(
    "--rate",
    "rate_hz",
    type=click.IntRange(1, 1000),
    default=None,
    help="lerobot: frames per s; default: the camera's.",
)
def export(recordings: tuple[Path, ...], form: str, out: Path, task: str | None, rate_hz: int | None) -> None:
    """Write recordings in the format of another tool.

    \b
    parquet   one table per topic: SI units in the metadata, arrays as lists
    ros2      a bag of CDR messages in an MCAP file, with metadata.yaml
    lerobot   a LeRobot dataset v3.0; several recordings are several episodes

    Nothing is overwritten. An export that fails leaves nothing behind but complete episodes.

    Takes: 30 s per minute of one finger to parquet, 20 s to ros2 or lerobot (on two cores).

    Writes: the new folder of --out.

    \b
    Examples:
      lsds record export run.mcap --to parquet --out tables
      lsds record export run.mcap --to ros2 --out bag
      lsds record export one.mcap two.mcap --to lerobot --out dataset \\
          --task "hold a glass"
    """
    from lsds.session.recording.files import contents

    if form != "lerobot":
        _refuse_the_options_of_lerobot(form, recordings, task, rate_hz)
    label = str(recordings[0]) if len(recordings) == 1 else f"{len(recordings)} recordings"
    with Progress(f"exporting {label}") as progress:
        if form == "lerobot":
            from lsds.session.recording.export.lerobot import TASK, to_lerobot

            written = to_lerobot(recordings, out, progress.to, task=task or TASK, rate_hz=rate_hz)
        elif form == "ros2":
            from lsds.session.recording.export.ros2 import to_ros2

            written = to_ros2(recordings[0], out, progress.to)
        else:
            from lsds.session.recording.export.parquet import to_parquet

            written = to_parquet(recordings[0], out, progress.to)
    heads, unit = (("recording", "frames"), "frames") if form == "lerobot" else (("topic", "messages"), "messages")
    click.echo(table([(name, str(number)) for name, number in written.items()], heads))
    click.echo(f"{out}: {sum(written.values())} {unit}")
    for recording in recordings:
        if damage := contents(recording)["damage"]:
            click.echo(f"warning: {recording} is {damage}: what follows is not in {out}", err=True)


def _refuse_the_options_of_lerobot(
    form: str, recordings: tuple[Path, ...], task: str | None, rate_hz: int | None
) -> None:
    if len(recordings) > 1:
        raise click.UsageError(f"--to {form} takes one recording, not {len(recordings)}: export them one by one")
    if task is not None or rate_hz is not None:
        raise click.UsageError(f"--task and --rate are for --to lerobot: leave them out for --to {form}")
