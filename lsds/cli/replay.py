"""`lsds replay`: the algorithms again on a recorded run."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from lsds.cli.output import json_option, require_writable, write_json
from lsds.cli.set_option import set_option
from lsds.cli.text_table import table
from lsds.cli.threads import one_thread
from lsds.errors import DataError

if TYPE_CHECKING:
    from lsds.session.replay import ReplayResult

DIFFERS = 13
"""Exit code where a replay differs from its recording."""


@click.command()
@click.argument("recording", type=click.Path(dir_okay=False, path_type=Path))
@set_option("Override a recorded option; repeatable.")
@click.option(
    "--plot", type=click.Path(dir_okay=False, path_type=Path), default=None, help="Draw both runs to this PNG."
)
@json_option
def replay(recording: Path, overrides: tuple[str, ...], plot: Path | None, json_file: str | None) -> None:
    """Run the algorithms again on a recorded run, and compare.

    Tracker, perception, detector, estimator, grip belief and controller run on the recorded frames and states, at the
    recorded times. The job's wishes and the devices' states stay as recorded, so a controller's commands have no
    effect. No device moves.

    Without --set the answers have to be the same bit by bit, if the images were recorded without loss. The exit code
    is 0 if they are, or if something was changed on purpose; 13 if they differ.

    Takes: about two thirds of the recorded time.

    Writes: nothing, except the files of --plot and --json.

    \b
    Examples:
      lsds run --record run.mcap
      lsds replay run.mcap                         the same answers?
      lsds replay run.mcap --set detector.backend=imprint --plot replay.png
                                                   what another detector reports
    """
    one_thread()
    for target in (json_file, plot):
        require_writable(target)
    from lsds.session.replay import replay as replayed

    result = replayed(recording, overrides)
    if json_file != "-":
        click.echo(_table(result))
    if json_file is not None:
        write_json(result.as_dict(), json_file)
    if plot is not None:
        from lsds.session.pictures.replay import draw_replay

        draw_replay(plot, result)
        click.echo(f"picture: {plot}", err=json_file == "-")
    if not result.cycles:
        raise DataError(f"{result.source}: {result.problem}" + (f" ({result.damage})" if result.damage else ""))
    if not overrides and not result.identical:
        raise click.exceptions.Exit(DIFFERS)


def _table(result: ReplayResult) -> str:
    rows = []
    for name, stream in sorted(result.streams.items()):
        alone = stream.only_recorded + stream.only_replayed
        size = f"{stream.largest:.3g}" if math.isfinite(stream.largest) else "not a number or another form"
        largest = f"{size} in {stream.where}" if stream.different and not stream.identical else ""
        first = "" if stream.identical else f"{stream.first_s:.2f} s"
        rows.append((name, str(stream.compared), str(stream.different), str(alone), first, largest))
    text = table(rows, ("stream", "compared", "differ", "in one only", "first", "largest difference"))
    same = "identical bit by bit" if result.identical else "different" if result.complete else "not to the end"
    lines = [text, "", f"{result.cycles} cycles replayed: {same}"]
    if result.problem:
        lines.append(f"the replay ended with: {result.problem}")
    if result.damage:
        lines.append(f"the recording is {result.damage} (lsds record repair)")
    return "\n".join(lines)
