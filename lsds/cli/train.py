"""`lsds train`: fit a learner on a dataset, and write the model that the running cell loads."""

from __future__ import annotations

from pathlib import Path

import click

from lsds.cli.output import json_option, require_writable, table, write_json


@click.command()
@click.argument("learner")
@click.option("--data", type=click.Path(path_type=Path), required=True, help="Folder of a dataset (lsds collect).")
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), required=True, help="The model's file, .onnx.")
@click.option("--option", "options", multiple=True, metavar="KEY=VALUE", help="An option of the learner; repeatable.")
@click.option("--without", multiple=True, metavar="OBJECT", help="An object not to learn from; repeatable.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@json_option
def train(
    learner: str, data: Path, out: Path, options: tuple[str, ...], without: tuple[str, ...], seed: int,
    json_file: str | None,
) -> None:  # fmt: skip
    """Fit LEARNER (see lsds plugins) on a dataset and write it as ONNX, with its card beside it.

    Scores and intervals on the card are of objects left out. Needs the train extra; running the model does not.

    \b
    Examples:
      lsds train field-mlp --data detection --out slip.onnx --without book --without sponge
      lsds train random-forest --data detection --out forest.onnx --option signals=proposed
      lsds run --set detector.backend=onnx --set detector.onnx.model=slip.onnx
    """
    from lsds.cli.threads import one_thread

    for file in (out if out.parent.is_dir() else None, json_file):
        require_writable(file)
    one_thread()
    import numpy as np

    from lsds.config.overrides import parse_value
    from lsds.learning.datasets import load
    from lsds.learning.evaluation.fitting import Model
    from lsds.learning.evaluation.shipping import train as run
    from lsds.plugins.host import PluginHost

    if out.suffix != ".onnx":
        raise click.UsageError(f"--out {out}: has to end in .onnx")
    for option in options:
        if "=" not in option:
            raise click.UsageError(f"--option {option}: needs KEY=VALUE, such as signals=field")
    chosen = {key: parse_value(value) for key, _, value in (option.partition("=") for option in options)}
    whole = load(data)
    unknown = set(without) - set(whole["object"].tolist())
    if unknown:
        raise click.UsageError(f"--without {', '.join(sorted(unknown))}: not in the dataset")
    part = whole.where(~np.isin(whole["object"], without)) if without else whole
    card = run(part, Model(learner, chosen), PluginHost(), out, seed)
    if json_file is not None:
        write_json(
            {"model": str(out), "job": card.job, "scores": card.scores, "trained_on": card.trained_on}, json_file
        )
    if json_file != "-":
        scores = card.scores or {}
        rows = [(key, f"{value:.4g}" if isinstance(value, float) else str(value)) for key, value in scores.items()]
        click.echo(table(rows, ("score", f"{out.name} ({card.figures_are})")))
