"""Run a study with a progress bar; print, write and draw its result."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lsds.cli.output import csv_text, write_json, write_text
from lsds.cli.progress import Progress
from lsds.cli.text_table import table
from lsds.cli.threads import one_thread
from lsds.contracts.study import StudyTable
from lsds.errors import DataError, MissingExtra
from lsds.support.extras import explained

if TYPE_CHECKING:
    from lsds.contracts.study import StudyResult
    from lsds.registry.host import PluginHost


def run_study(host: PluginHost, name: str, options: Mapping[str, Any], seed: int, doing: str) -> StudyResult:
    """Run a study. Raises PluginError if it cannot be built, and every error of the study itself."""
    one_thread()
    from lsds.clock import WallClock
    from lsds.contracts import BuildContext, Study

    built: Study = host.build("study", name, options, BuildContext(WallClock(), seed))
    with Progress(doing) as progress:
        return built.run(progress.to)


def show_study(
    result: StudyResult, plot: Path | None, csv_file: str | None, json_file: str | None, *, asked: bool = True
) -> None:
    """Print tables and notes, write the files, draw the picture. Raises DataError if a file cannot be written.

    If drawing needs a library that is not installed, everything else is still printed and written. After that it raises
    MissingExtra if the picture was `asked` for, else prints a line on stderr.
    """
    for warning in result.warnings:
        click.echo(warning, err=True)
    rows = [dict(row) for row in result.rows]
    if json_file is not None:
        write_json(as_json(result), json_file)
    if json_file != "-":
        parts = [*result.more, StudyTable(result.columns, result.rows)]
        click.echo("\n\n".join([result.title, *map(_text, parts)]))
        click.echo("".join(f"\n{note}" for note in result.notes))
    if csv_file is not None:
        write_text(csv_text(rows), csv_file)
    if plot is not None:
        try:
            _draw(result, plot, err=json_file == "-", asked=asked)
        except MissingExtra as error:
            if asked:
                raise
            click.echo(f"no picture: {error}", err=True)


def as_json(result: StudyResult) -> dict[str, Any]:
    """Return what `--json` writes of a result."""
    rows = [dict(row) for row in result.rows]
    more = {"tables": [[dict(row) for row in part.rows] for part in result.more]} if result.more else {}
    return {"title": result.title, "rows": rows, "notes": list(result.notes), **more, **result.details}


def _draw(result: StudyResult, plot: Path, *, err: bool, asked: bool) -> None:
    if result.draw is None:
        if asked:
            click.echo("no picture: this study does not draw one", err=True)
        return
    drawn(result, plot)
    click.echo(f"picture: {plot}", err=err)


def drawn(result: StudyResult, plot: Path) -> None:
    """Draw a result that has a picture. Raises DataError if the file cannot be written, and MissingExtra."""
    if result.draw is None:
        return
    try:
        result.draw(plot)
    except ModuleNotFoundError as error:
        if (missing := explained(error)) is None:
            raise
        raise missing from error
    except (OSError, ValueError) as error:
        raise DataError(f"{plot}: the picture cannot be written: {error}") from error


def _text(part: StudyTable) -> str:
    cells = [tuple(shown(row.get(key), form) for key, _, form in part.columns) for row in part.rows]
    return table(cells, tuple(heading for _, heading, _ in part.columns))


def shown(value: object, form: str) -> str:
    """Return a cell of a table as text."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return format(value, form) if form else str(value)
