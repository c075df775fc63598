"""Put a report together: one file that needs no other, and that a browser can open from disk."""

from __future__ import annotations

import html
import json
import re
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lsds.errors import DataError
from lsds.session.recording.report import tables
from lsds.session.recording.report.figure import STAGE_PLACE, figure_of
from lsds.session.recording.report.gather import gather
from lsds.support.extras import require
from lsds.support.plotly_js import plotly_js

if TYPE_CHECKING:
    from lsds.session.recording.report.gather import RunData


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
    library, version = plotly_js()
    outcome, reasons = tables.outcome_of(data)
    events, left_out = tables.listed(data)
    title = f"{data.path.name}: {outcome}"
    parts = {
        "title": html.escape(title),
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
        "result": _rows(tables.result_rows(data)),
        "simulation": _rows(tables.simulation_rows(data)),
        "timing": _rows(tables.timing_rows(data)),
        "versions": _rows(tables.version_rows(data, version)),
        "backends": _rows(tables.backend_rows(data)),
        "config": html.escape(data.header.config),
        "style": _file("page.css"),
        "script": _file("page.js"),
        "data": _data(data),
        "library": library,
    }
    # One pass, so that a name in braces inside of a value stays as it is.
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], _file("page.html"))


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


def _rows(rows: tables.Rows) -> str:
    return "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>" for name, value in rows)


def _data(data: RunData) -> str:
    value = {
        "figure": figure_of(data),
        "stages": [stage._asdict() for stage in data.stages],
        "stage_place": STAGE_PLACE,
        "images": {name: {"t_s": own.t_s, "urls": own.urls} for name, own in data.images.items()},
    }
    # A "</script>" inside of a value would end the element that holds it.
    return json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _file(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")
