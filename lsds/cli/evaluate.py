"""`lsds evaluate`: what models are worth on data that they have not seen, real recordings above all."""

from __future__ import annotations

from pathlib import Path

import click

from lsds.cli.output import json_option, require_writable
from lsds.cli.study_output import run_study, show_study, study_command
from lsds.cli.threads import MOST_PROCESSES, one_thread, processes


@click.group()
def evaluate() -> None:
    """Score models on data that they have not seen, beside what knows nothing.

    \b
    Examples:
      lsds evaluate models detection/
      lsds evaluate incipient-slip recordings/
    """


@evaluate.command("models")
@click.argument("data", type=click.Path(path_type=Path))
@click.option("--model", "models", multiple=True, metavar="NAME|FILE",
              help="A shipped model, or a file (.onnx) of lsds train; repeatable.  [default: all shipped]")  # fmt: skip
@click.option("--job", type=click.Choice(["detect", "estimate"]), help="What for.  [default: by the dataset]")
@click.option("--object", "objects", multiple=True, metavar="NAME",
              help="To be scored on; repeatable.  [default: all that no model has learnt from]")  # fmt: skip
@click.option("--csv", "csv_file", metavar="FILE", help="Write the table as CSV.")
@click.option("--plot", metavar="FILE", help="Draw the scores, object by object, to this PNG.")
@json_option
def models(
    data: Path, models: tuple[str, ...], job: str | None, objects: tuple[str, ...], csv_file: str | None,
    plot: str | None, json_file: str | None,
) -> None:  # fmt: skip
    """Score models as they are on a dataset's objects that they have not learnt from. Nothing is trained.

    DATA is a folder of lsds collect, or one in data/ of lsds reproduce. Needs the data extra.

    \b
    Examples:
      lsds evaluate models detection
      lsds evaluate models severity --model field-gru --model mine.onnx --plot speeds.png
      lsds evaluate models detection --job estimate --object book --json book.json
    """
    options: dict[str, object] = {"data": str(data), "models": list(models), "job": job or "", "objects": list(objects)}
    study_command("models", options, 0, plot, csv_file, json_file, "scoring")


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
@click.option("--jobs", type=click.IntRange(1, MOST_PROCESSES), help="Processes; all cores if not given.")
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
    from lsds_research.incipient.index import read_index

    for file in (plot, csv_file, json_file, save_clip_model):
        require_writable(file)
    if save_clip_model is not None and not save_clip_model.endswith(".onnx"):
        raise click.UsageError("--save-clip-model names a file that ends in .onnx")
    for folder in (path, *(() if train is None else (train,))):
        read_index(folder)  # What is wrong with it is told before anything is computed.
    options: dict[str, object] = {
        "path": str(path), "train": str(train or ""), "model": model, "slower": slower, "cache": cache,
        "repeats": repeats, "jobs": jobs or processes(), "save_model": save_clip_model or "",
    }  # fmt: skip
    result = run_study("incipient-slip", options, seed, "reading, training")
    for reason in result.details["failures"].values():
        click.echo(f"passed over: {reason}", err=True)
    if save_clip_model is not None:
        click.echo(f"clip model: {save_clip_model}", err=json_file == "-")
    show_study(result, plot, csv_file, json_file)
