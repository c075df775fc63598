"""The page of a study or a campaign: tables, picture, a plot of its rows, and how it was made, in one HTML file."""

from __future__ import annotations

import base64
import html
import platform
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lsds.cli.output import plain, require_writable, to_json, write_text
from lsds.cli.study_output import drawn, shown
from lsds.clock import utc_s
from lsds.contracts.study import StudyTable
from lsds.errors import DataError, MissingExtra
from lsds.support.extras import require
from lsds.support.plotly_page import plotly_page, plotly_version, table_rows

if TYPE_CHECKING:
    from lsds.contracts.study import StudyResult

_LIBRARIES = ("lsds-tactile", "numpy", "opencv-python-headless", "onnxruntime", "numba")
"""Distributions whose versions the page states, where they are installed."""


@dataclass(frozen=True, slots=True)
class Made:
    """How a result was made: the study, its options, its seed, and how long it took."""

    study: str
    options: Mapping[str, Any]
    seed: int
    took_s: float


def require_report(out: Path | None) -> None:
    """Raise before any work if the page cannot be made: MissingExtra, or DataError for its folder."""
    if out is not None:
        require("plotly", extra="report", purpose="a report")
        require_writable(out)


def write_report(result: StudyResult, made: Made, out: Path) -> None:
    """Write the page, in place of an earlier one. Raises DataError if it cannot be written, and MissingExtra."""
    write_text(page_of(result, made, datetime.fromtimestamp(utc_s(), UTC)), out)


def page_of(result: StudyResult, made: Made, at: datetime) -> str:
    """Return the page of a result that was finished at a time."""
    rows = [("study", made.study), ("seed", str(made.seed)), ("took", f"{made.took_s:.0f} s")]
    rows += [("finished", at.isoformat(timespec="seconds")), *_versions(), ("plotly.js", plotly_version())]
    parts = {
        "warnings": "".join(f'<p class="warning">{html.escape(text)}</p>' for text in result.warnings),
        "notes": "".join(f"<li>{html.escape(note)}</li>" for note in result.notes),
        "tables": "".join(map(_table, (*result.more, StudyTable(result.columns, result.rows)))),
        "picture": _picture(result),
        "made": table_rows(rows),
        "options": html.escape(to_json(dict(made.options))),
    }
    return plotly_page(result.title, __name__, parts, _plotted(result))


def _table(part: StudyTable) -> str:
    heads = "".join(f"<th>{html.escape(heading)}</th>" for _, heading, _ in part.columns)
    rows = "".join(
        "<tr>" + "".join(_cell(row.get(key), form) for key, _, form in part.columns) + "</tr>" for row in part.rows
    )
    return f'<div class="scroll"><table class="rows"><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table></div>'


def _cell(value: object, form: str) -> str:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return f"<td{' class=number' if number else ''}>{html.escape(shown(value, form))}</td>"


def _picture(result: StudyResult) -> str:
    """Return the study's own picture as an element."""
    if result.draw is None:
        return "<p>This study draws none.</p>"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.png"
        try:
            drawn(result, path)
        except (MissingExtra, DataError) as error:
            # The figures of a long campaign are not lost with its picture.
            return f"<p>No picture: {html.escape(str(error))}</p>"
        data = base64.b64encode(path.read_bytes()).decode("ascii")
    return f'<img class="picture" alt="{html.escape(result.title)}" src="data:image/png;base64,{data}">'


def _plotted(result: StudyResult) -> dict[str, Any]:
    """Return the runs or rows to plot, with the headings of the table where they are its rows."""
    runs = result.details.get("runs")
    rows, headings = result.rows, {key: heading for key, heading, _ in result.columns}
    if isinstance(runs, list) and runs and all(isinstance(row, Mapping) for row in runs):
        rows, headings = runs, {}
    points = [_flat(plain(dict(row))) for row in rows]
    keys = list(dict.fromkeys([*headings, *(key for row in points for key in row)]))
    return {"columns": [{"key": key, "name": headings.get(key, key)} for key in keys], "rows": points}


def _flat(row: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return a row whose inner mappings are keys `outer.inner`; lists are left out."""
    found: dict[str, Any] = {}
    for key, value in row.items():
        if isinstance(value, Mapping):
            found |= _flat(value, f"{prefix}{key}.")
        elif not isinstance(value, list):
            found[f"{prefix}{key}"] = value
    return found


def _versions() -> list[tuple[str, str]]:
    found = [("python", platform.python_version())]
    for name in _LIBRARIES:
        try:
            found.append((name, metadata.version(name)))
        except metadata.PackageNotFoundError:
            continue
    return found
