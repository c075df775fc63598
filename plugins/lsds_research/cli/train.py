"""`lsds learn train`: fit a learner on a dataset, and write the model that the running cell loads."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lsds.cli.complete import backends, simulated_object
from lsds.cli.output import json_option, require_writable, write_json
from lsds.cli.text_table import table
from lsds.registry.backends import did_you_mean
from lsds.support.extras import require

if TYPE_CHECKING:
    from lsds_research.datasets import Dataset


@click.command()
@click.argument("learner", shell_complete=backends("learner"))
@click.option(
    "--data",
    "folders",
    type=click.Path(path_type=Path),
    multiple=True,
    help="Folder of a dataset (lsds learn collect) to train on; repeatable.",
)
@click.option(
    "--labelled",
    type=click.Path(path_type=Path),
    multiple=True,
    help="Folder of recordings labelled frame by frame (lsds learn label) to train a detector on; repeatable.",
)
@click.option(
    "--out", type=click.Path(dir_okay=False, path_type=Path), required=True, help="Model file to write, .onnx."
)
@click.option(
    "--option", "options", multiple=True, metavar="KEY=VALUE", help="Set an option of the learner; repeatable."
)
@click.option(
    "--without",
    multiple=True,
    metavar="OBJECT",
    shell_complete=simulated_object,
    help="Leave this object out of training; repeatable.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@json_option
def train(
    learner: str,
    folders: tuple[Path, ...],
    labelled: tuple[Path, ...],
    out: Path,
    options: tuple[str, ...],
    without: tuple[str, ...],
    seed: int,
    json_file: str | None,
) -> None:
    """Fit LEARNER (see lsds plugins) on a dataset and write an ONNX model with its card next to it.

    The card holds scores and intervals on held-out objects, and those of trivial baselines. Needs the train extra;
    running the model does not.

    Takes: seconds for small learners, minutes for neural networks.

    Writes: the model of --out, and its card next to it.

    \b
    Examples:
      lsds learn train field-mlp --data detection --out slip.onnx \\
          --without book --without sponge
      lsds learn train fused --labelled recordings --out slip.onnx
      lsds learn train random-forest --data detection --out forest.onnx \\
          --option signals=proposed
      lsds learn train field-gru --data severity --data catch --out speed.onnx
      lsds run --set detector.backend=onnx --set detector.onnx.model=slip.onnx
    """
    from lsds.cli.threads import one_thread

    for file in (out, json_file):
        require_writable(file)
    require("pyarrow", "sklearn", "onnx", extra="train", purpose="training")
    one_thread()
    import numpy as np

    from lsds.config.overrides import parse_value
    from lsds.registry.host import PluginHost
    from lsds_research.datasets import load, merged
    from lsds_research.evaluation.fitting import Model
    from lsds_research.evaluation.shipping import train as run

    if out.suffix != ".onnx":
        raise click.UsageError(f"--out {out}: must end in .onnx")
    for option in options:
        if "=" not in option:
            raise click.UsageError(f"--option {option}: needs KEY=VALUE, such as signals=field")
    chosen = {key: parse_value(value) for key, _, value in (option.partition("=") for option in options)}
    if not folders and not labelled:
        raise click.UsageError("nothing to train on: give --data, --labelled, or both")
    own = [(str(folder), load(folder)) for folder in folders] + [
        (str(folder), _labelled(folder)) for folder in labelled
    ]
    whole = merged(own)
    require_part(whole["object"].tolist(), without)
    part = whole.where(~np.isin(whole["object"], without)) if without else whole
    card = run(part, Model(learner, chosen), PluginHost(), out, seed)
    if json_file is not None:
        report = {"model": str(out), "job": card.job, "scores": card.scores, "trained_on": card.trained_on}
        write_json(report, json_file)
    if json_file != "-":
        click.echo(scores_table(dict(card.scores or {}), f"{out.name} ({card.figures_are})"))


def _labelled(folder: Path) -> Dataset:
    """Return the labelled frames of a folder of recordings."""
    from lsds.cli.progress import Progress
    from lsds.cli.threads import processes
    from lsds_research.slips.folder import as_dataset, labels_of, read_folder

    with Progress(f"reading {folder}") as progress:
        recordings, failures = read_folder(folder, labels_of(folder), jobs=processes(), tick=progress.to)
    for reason in failures.values():
        click.echo(f"passed over: {reason}", err=True)
    return as_dataset(recordings)


def require_part(objects: list[str], without: tuple[str, ...]) -> None:
    """Raise click.UsageError if an object to leave out is not in the dataset, or if no object would remain."""
    known = set(objects)
    for name in without:
        if name not in known:
            hint = did_you_mean(name, known) or f"its objects are {', '.join(sorted(known))}"
            raise click.UsageError(f"--without {name}: not in the dataset; {hint}")
    if known == set(without):
        raise click.UsageError("--without leaves no object to train on")


def scores_table(scores: dict[str, Any], title: str) -> str:
    """Return a card's scores as a text table, with those of the baselines in further columns."""
    baselines = scores.pop("beside", {})
    rows = []
    for key, value in scores.items():
        named = f"{key} ({_UNITS[key]})" if key in _UNITS else key
        rows.append((named, _shown(value), *(_shown(rule.get(key, "")) for rule in baselines.values())))
    return table(rows, ("score", title, *baselines))


_UNITS = {
    **dict.fromkeys(("mae", "mae_low", "mae_high", "rmse", "moving_mae", "moving_rmse", "interval_width"), "m/s"),
    "angular_mae": "rad/s",
}


def _shown(value: object) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
