"""The command of one study: flags made from its options, `--set`, and the output files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lsds.cli.complete import fields
from lsds.cli.help_text import with_paragraph
from lsds.cli.model_flags import flags, given, written_files, written_flags
from lsds.cli.output import JSON_OPTION, require_writable
from lsds.cli.plugged import host_of
from lsds.clock import NS_PER_S, perf_ns
from lsds.config.overrides import apply_overrides
from lsds.errors import ConfigError

if TYPE_CHECKING:
    from pydantic import BaseModel

_OUTPUTS = ("plot", "no_plot", "csv_file", "json_file", "report")
_FLAGS = ("--set", "--seed", "--plot", "--no-plot", "--csv", "--json", "--report", "--help")
_TAKEN = (*_FLAGS, "overrides", "seed", *_OUTPUTS)
"""Flags and parameters common to all studies. An option with such a name is set by `--set`, `seed` by `--seed`."""


def study_command(
    name: str,
    model: type[BaseModel] | None,
    text: str,
    *,
    study: str = "",
    positional: tuple[str, ...] = (),
    picture: Path | None = None,
    doing: str = "measuring",
) -> click.Command:
    """Return the command `name` that runs the study `study` (by default of the same name).

    `model` is the model of the study's options, `text` the help, `positional` the fields that are arguments, `picture`
    the default of `--plot`, `doing` the label of the progress bar.
    """
    params = [*flags(model, positional, _TAKEN), *_common(model, picture)]
    files = [*([] if picture else ["--plot"]), "--csv", "--json", "--report", *written_flags(model)]
    default = f"{picture} (see --plot), and" if picture else "nothing, except"
    text = with_paragraph(text, f"Writes: {default} the files of {', '.join(files[:-1])} and {files[-1]}.")

    def callback(overrides: tuple[str, ...], seed: int | None, **values: Any) -> None:
        from lsds.cli.study_output import run_study, show_study
        from lsds.cli.study_report import Made, require_report, write_report

        ctx = click.get_current_context()
        outputs = {key: values.pop(key) for key in _OUTPUTS}
        plot = outputs["plot"] or (None if outputs["no_plot"] else picture)
        for file in (plot, outputs["csv_file"], outputs["json_file"]):
            require_writable(file)
        require_report(outputs["report"])
        options = given(model, values)
        if seed is not None and _has_seed(model):
            options["seed"] = seed
        if issues := apply_overrides(options, overrides):
            raise ConfigError("command line", issues)
        _require_all(ctx, model, options)
        for written in written_files(model, options):
            require_writable(written)
        run_seed, begun_ns = _run_seed(model, options, seed), perf_ns()
        try:
            result = run_study(host_of(ctx), study or name, options, run_seed, doing)
        except KeyboardInterrupt:
            if options.get("out"):
                click.echo(f"the runs so far are in {options['out']}; the same command continues from there", err=True)
            raise
        took_s = (perf_ns() - begun_ns) / NS_PER_S
        try:
            show_study(result, plot, outputs["csv_file"], outputs["json_file"], asked=outputs["plot"] is not None)
        finally:
            if outputs["report"] is not None:
                complete = {} if model is None else model.model_validate(options).model_dump(mode="json")
                write_report(result, Made(study or name, complete, run_seed, took_s), outputs["report"])
                click.echo(f"report: {outputs['report']}", err=True)

    return click.Command(name, params=params, callback=callback, help=text)


def _common(model: type[BaseModel] | None, picture: Path | None) -> list[click.Parameter]:
    """Return the parameters common to all studies."""
    field = None if model is None else model.model_fields.get("seed")
    description = (field.description if field else "") or "seed of the run"
    return [
        click.Option(
            ["--set", "overrides"],
            multiple=True,
            metavar="KEY=VALUE",
            shell_complete=fields(() if model is None else model.model_fields),
            help="Set any option; repeatable.",
        ),
        click.Option(
            ["--seed"],
            type=click.IntRange(min=0),
            help=f"{description[:1].upper()}{description[1:]}.  [default: {_default_seed(model)}]",
            metavar="N",
        ),
        click.Option(
            ["--plot"],
            type=click.Path(dir_okay=False, path_type=Path),
            metavar="FILE",
            help="Draw the result to this PNG." + (f"  [default: {picture}]" if picture else ""),
        ),
        click.Option(["--no-plot"], is_flag=True, help="Draw nothing.", hidden=picture is None),
        click.Option(["--csv", "csv_file"], metavar="FILE", help="Write the table as CSV."),
        click.Option(["--json", "json_file"], **JSON_OPTION),
        click.Option(
            ["--report"],
            type=click.Path(dir_okay=False, path_type=Path),
            metavar="F.html",
            help="Write one page: tables, picture, a plot of the rows, options and versions.",
        ),
    ]


def _has_seed(model: type[BaseModel] | None) -> bool:
    return model is not None and "seed" in model.model_fields


def _run_seed(model: type[BaseModel] | None, options: dict[str, Any], seed: int | None) -> int:
    """Return the seed of the run: the option `seed` if the study has one."""
    chosen = options.get("seed", _default_seed(model)) if _has_seed(model) else seed
    return chosen if isinstance(chosen, int) else 0


def _default_seed(model: type[BaseModel] | None) -> int:
    default = None if model is None or "seed" not in model.model_fields else model.model_fields["seed"].default
    return default if isinstance(default, int) else 0


def _require_all(ctx: click.Context, model: type[BaseModel] | None, options: dict[str, Any]) -> None:
    """Raise click.MissingParameter for a required option that neither a flag nor `--set` gives."""
    for name, field in ({} if model is None else model.model_fields).items():
        if field.is_required() and name not in options:
            param = next((p for p in ctx.command.params if p.name == name), None)
            raise click.MissingParameter(ctx=ctx, param=param, param_hint=None if param else f"'--set {name}=...'")
