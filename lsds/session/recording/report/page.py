"""Put a report together: one file that needs no other, and that a browser can open from disk."""

from __future__ import annotations

import html
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lsds.errors import DataError
from lsds.session.recording.report import tables
from lsds.session.recording.report.figure import STAGE_PLACE, figure_of
from lsds.session.recording.report.gather import gather
from lsds.support.extras import require
from lsds.support.plotly_page import plotly_page, plotly_version, table_rows

if TYPE_CHECKING:
    from lsds.session.recording.report.gather import RunData


PAGE = "lsds.session.recording.report"
"""Package of the page's files."""


def require_new(out: Path) -> None:
    """Raise before any work if a report cannot be made: MissingExtra, or DataError for a file that exists."""
    require("plotly", "mcap", "foxglove_schemas_protobuf", extra="report", purpose="a report")
    if out.exists():
        raise DataError(f"{out}: exists already, and a report overwrites nothing (choose another name, or remove it)")
    if not out.parent.is_dir():
        raise DataError(f"{out}: the report cannot be written: no folder {out.parent} (create it)")


def write_report(recording: str | Path, out: str | Path, summary: dict[str, Any] | None = None) -> str:
    """Write the report of a recording to a new file; return the damage of the recording, "" for none.

    `summary` is that of the run for a recording that could not be finished. Raises DataError: no recording, or the file
    exists or cannot be written; MissingExtra.
    """
    target = Path(out)
    require_new(target)
    data = gather(recording)
    if data.summary is None:
        data.summary = summary
    text = page_of(data)
    try:
        with target.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        require_new(target)
        raise
    except OSError as error:
        target.unlink(missing_ok=True)
        raise DataError(f"{target}: the report cannot be written: {error.strerror or error}") from error
    return data.damage


def page_of(data: RunData) -> str:
    """Return the page."""
    outcome, reasons = tables.outcome_of(data)
    events, left_out = tables.listed(data)
    parts = {
        "outcome": html.escape(outcome),
        "reasons": "".join(f"<p>{html.escape(reason)}</p>" for reason in reasons),
        "damage": _note(data),
        "fingers": "".join(_finger(name) for name in data.images),
        "events": "".join(
            f'<tr data-s="{each.t_s}" tabindex="0"><td class="number">{each.t_s:.3f}</td><td class="{each.kind}">'
            f"{each.kind}</td><td>{html.escape(each.text)}</td></tr>"
            for each in events
        ),
        "left_out": html.escape(left_out),
        "result": table_rows(tables.result_rows(data)),
        "simulation": table_rows(tables.simulation_rows(data)),
        "timing": table_rows(tables.timing_rows(data)),
        "versions": table_rows(tables.version_rows(data, plotly_version())),
        "backends": table_rows(tables.backend_rows(data)),
        "config": html.escape(data.header.config),
    }
    plotted = {
        "figure": figure_of(data),
        "stages": [stage._asdict() for stage in data.stages],
        "stage_place": STAGE_PLACE,
        "images": {name: {"t_s": own.t_s, "urls": own.urls} for name, own in data.images.items()},
    }
    return plotly_page(f"{data.path.name}: {outcome}", PAGE, parts, plotted)


def _note(data: RunData) -> str:
    if not data.damage:
        return ""
    return (
        f'<p class="warning">The recording is incomplete: {html.escape(data.damage)}. This page shows the '
        f"{data.end_s - data.begin_s:.2f} s before.</p>"
    )


def _finger(name: str) -> str:
    safe = html.escape(name, quote=True)
    return f'<figure><img data-finger="{safe}" alt="tactile image of {safe}"><figcaption></figcaption></figure>'
