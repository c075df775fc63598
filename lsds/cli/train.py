"""`lsds train`: fit a learner on a dataset, and write the model that the running cell loads."""

from __future__ import annotations

from pathlib import Path

import click

from lsds.cli.output import json_option, require_writable, table, write_json


@click.command()
@click.argument("learner")
@click.option("--data", "folders", type=click.Path(path_type=Path), required=True, multiple=True,
              help="Folder of a dataset (lsds collect); repeatable: all are learnt from.")  # fmt: skip
@click.option("--out", type=click.Path(dir_okay=False, path_type=Path), required=True, help="The model's file, .onnx.")
@click.option("--option", "options", multiple=True, metavar="KEY=VALUE", help="An option of the learner; repeatable.")
@click.option("--without", multiple=True, metavar="OBJECT", help="An object not to learn from; repeatable.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@json_option
def train(
    learner: str, folders: tuple[Path, ...], out: Path, options: tuple[str, ...], without: tuple[str, ...], seed: int,
    json_file: str | None,
) -> None:  # fmt: skip
    """Fit LEARNER (see lsds plugins) on a dataset and write it as ONNX, with its card beside it.

    Scores and intervals on the card are of objects left out; beside them stand the rules that know nothing, or one
    number. Needs the train extra; running the model does not.

    \b
    Examples:
      lsds train field-mlp --data detection --out slip.onnx --without book --without sponge
      lsds train random-forest --data detection --out forest.onnx --option signals=proposed
      lsds train field-gru --data severity --data catch --out speed.onnx
      lsds run --set detector.backend=onnx --set detector.onnx.model=slip.onnx
    """
    from lsds.cli.threads import one_thread

    for file in (out, json_file):
        require_writable(file)
    one_thread()
    import numpy as np

    from lsds.config.overrides import parse_value
    from lsds.learning.datasets import load, merged
    from lsds.learning.evaluation.fitting import Model
    from lsds.learning.evaluation.shipping import train as run
    from lsds.plugins.host import PluginHost
    from lsds.plugins.registry import did_you_mean

    if out.suffix != ".onnx":
        raise click.UsageError(f"--out {out}: has to end in .onnx")
    for option in options:
        if "=" not in option:
            raise click.UsageError(f"--option {option}: needs KEY=VALUE, such as signals=field")
    chosen = {key: parse_value(value) for key, _, value in (option.partition("=") for option in options)}
    whole = merged({str(folder): load(folder) for folder in folders})
    objects = set(whole["object"].tolist())
    for name in without:
        if name not in objects:
            hint = did_you_mean(name, objects) or f"it has {', '.join(sorted(objects))}"
            raise click.UsageError(f"--without {name}: not in the dataset; {hint}")
    if objects == set(without):
        raise click.UsageError("--without leaves nothing to learn from")
    part = whole.where(~np.isin(whole["object"], without)) if without else whole
    card = run(part, Model(learner, chosen), PluginHost(), out, seed)
    if json_file is not None:
        write_json(
            {"model": str(out), "job": card.job, "scores": card.scores, "trained_on": card.trained_on}, json_file
        )
    if json_file != "-":
        scores = dict(card.scores or {})
        beside = scores.pop("beside", {})
        rows = [
            (
                f"{key} ({_UNITS[key]})" if key in _UNITS else key,
                _shown(value),
                *(_shown(plain.get(key, "")) for plain in beside.values()),
            )
            for key, value in scores.items()
        ]
        click.echo(table(rows, ("score", f"{out.name} ({card.figures_are})", *beside)))


_UNITS = {
    **dict.fromkeys(("mae", "mae_low", "mae_high", "rmse", "moving_mae", "moving_rmse", "interval_width"), "m/s"),
    "angular_mae": "rad/s",
}


def _shown(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
