"""Studies that plugins offer, as commands: run with a progress bar, shown as a table, written, drawn."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from lsds.cli.output import csv_text, require_writable, table, write_json, write_text
from lsds.cli.progress import Progress
from lsds.cli.threads import one_thread
from lsds.errors import DataError

if TYPE_CHECKING:
    from lsds.contracts.study import StudyResult


def run_study(name: str, options: dict[str, object], seed: int, doing: str) -> StudyResult:
    """Run a study. Raises what it raises, PluginError where there is none of that name."""
    from lsds.clock import WallClock
    from lsds.contracts import BuildContext, Study
    from lsds.plugins.host import PluginHost

    built: Study = PluginHost().build("study", name, options, BuildContext(WallClock(), seed))
    with Progress(doing) as progress:
        return built.run(progress.to)


def show_study(result: StudyResult, plot: Path | str | None, csv_file: str | None, json_file: str | None) -> None:
    """Print the table and notes, write what is asked for, draw the picture. Raises DataError where one cannot be."""
    rows = [dict(row) for row in result.rows]
    if json_file is not None:
        write_json({"title": result.title, "rows": rows, "notes": list(result.notes), **result.details}, json_file)
    if json_file != "-":
        shown = [tuple(_shown(row.get(key), form) for key, _, form in result.columns) for row in rows]
        click.echo(f"{result.title}\n\n" + table(shown, tuple(heading for _, heading, _ in result.columns)))
        click.echo("".join(f"\n{note}" for note in result.notes))
    if csv_file is not None:
        write_text(csv_text(rows), csv_file)
    if plot is None:
        return
    try:
        result.draw(Path(plot))
    except (OSError, ValueError) as error:
        raise DataError(f"{plot}: the picture cannot be written: {error}") from error
    click.echo(f"picture: {plot}", err=json_file == "-")


def study_command(
    name: str, options: dict[str, object], seed: int, plot: Path | str | None, csv_file: str | None,
    json_file: str | None, doing: str = "measuring",
) -> None:  # fmt: skip
    """Run a study that a plugin offers; show, write and draw what it found. What cannot be written is told first."""
    one_thread()
    for file in (plot, csv_file, json_file):
        require_writable(file)
    show_study(run_study(name, options, seed, doing), plot, csv_file, json_file)


def _shown(value: object, form: str) -> str:
    if value is None:
        return "-"
    return format(value, form) if form else str(value)
