"""`lsds evaluate`: what learning is worth on recordings of real things."""

from __future__ import annotations

import csv
import io
import os
import sys
from pathlib import Path

import click

from lsds.cli.output import json_option, require_writable, table, write_json, write_text
from lsds.cli.threads import one_thread
from lsds.errors import DataError


@click.group()
def evaluate() -> None:
    """Train and test on real recordings, beside what knows nothing.

    \b
    Example:
      lsds evaluate incipient-slip recordings/
    """


@evaluate.command("incipient-slip")
@click.argument("path", type=click.Path(path_type=Path))
@click.option("--train", type=click.Path(path_type=Path), metavar="FOLDER",
              help="Also train on this folder's objects and test on PATH's.")  # fmt: skip
@click.option("--model", default="shipped", show_default=True, metavar="FILE",
              help="Simulation-trained detector (.onnx) to apply as it is; 'none' for none.")  # fmt: skip
@click.option("--slower", type=click.FloatRange(0.1, 100), default=3.0, show_default=True,
              help="True frame interval over the nominal: divides the rates that --model sees.")  # fmt: skip
@click.option("--cache", metavar="DIR", default="", help="Keep what was read there; 'none' keeps nothing.  "
              "[default: the user's cache folder]")  # fmt: skip
@click.option("--jobs", type=click.IntRange(min=1), help="Processes; all cores if not given.")
@click.option("--repeats", type=click.IntRange(1, 50), default=3, show_default=True, help="Dealings into folds.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of folds and models.")
@click.option("--save-clip-model", metavar="FILE", help="Fit the clip model on all of PATH and write it (.onnx).")
@click.option("--csv", "csv_file", metavar="FILE", help="Write the table as CSV.")
@click.option("--plot", metavar="FILE", help="Draw ROC curves and the online course to this PNG.")
@json_option
def incipient_slip(
    path: Path, train: Path | None, model: str, slower: float, cache: str, jobs: int | None, repeats: int, seed: int,
    save_clip_model: str | None, csv_file: str | None, plot: str | None, json_file: str | None,
) -> None:  # fmt: skip
    """Tell recordings with slip from those without, on objects never trained on.

    PATH holds index.csv (columns video, recording, object, camera, slip, and label_conflict if need be) and the videos
    that it names. All models see clips of equal length, as a recording's length tells its label. Offline figures stand
    beside causal ones, and beside the rule of one number, the majority, shuffled labels and nuisances. A video that
    cannot be read is told and passed over.

    \b
    Examples:
      lsds evaluate incipient-slip recordings/
      lsds evaluate incipient-slip recordings/ --plot roc.png --csv table.csv --json result.json
      lsds evaluate incipient-slip recordings/ --model detector.onnx --jobs 4
      lsds evaluate incipient-slip new-objects/ --train recordings/
    """
    one_thread()
    from lsds.clock import WallClock
    from lsds.contracts import BuildContext, Study
    from lsds.learning.incipient import read_index
    from lsds.plugins.host import PluginHost

    for file in (plot, csv_file, json_file, save_clip_model):
        require_writable(file)
    if save_clip_model is not None and not save_clip_model.endswith(".onnx"):
        raise click.UsageError("--save-clip-model names a file that ends in .onnx")
    for folder in (path, *(() if train is None else (train,))):
        read_index(folder)  # What is wrong with it is told before anything is computed.
    options = {
        "path": str(path), "train": str(train or ""), "model": model, "slower": slower, "cache": cache,
        "repeats": repeats, "jobs": jobs or os.cpu_count() or 1, "save_model": save_clip_model or "",
    }  # fmt: skip
    built: Study = PluginHost().build("study", "incipient-slip", options, BuildContext(WallClock(), seed))
    with click.progressbar(length=1000, label="reading, training", file=sys.stderr) as bar:
        result = built.run(lambda done, whole: bar.update(1000 * done // whole - bar.pos))
        bar.update(1000 - bar.pos)
    for reason in result.details["failures"].values():
        click.echo(f"passed over: {reason}", err=True)
    rows: list[dict[str, object]] = [dict(row) for row in result.rows]
    if json_file is not None:
        write_json({"title": result.title, "rows": rows, "notes": list(result.notes), **result.details}, json_file)
    if json_file != "-":
        shown = [tuple(_shown(row.get(key), form) for key, _, form in result.columns) for row in rows]
        click.echo(f"{result.title}\n\n" + table(shown, tuple(heading for _, heading, _ in result.columns)))
        click.echo("".join(f"\n{note}" for note in result.notes))
    if csv_file is not None:
        write_text(_csv(rows), csv_file)
    if save_clip_model is not None:
        click.echo(f"clip model: {save_clip_model}", err=json_file == "-")
    if plot is not None:
        try:
            result.draw(Path(plot))
        except (OSError, ValueError) as error:
            raise DataError(f"{plot}: the picture cannot be written: {error}") from error
        click.echo(f"picture: {plot}", err=json_file == "-")


def _shown(value: object, form: str) -> str:
    return format(value, form) if form else str(value)


def _csv(rows: list[dict[str, object]]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
