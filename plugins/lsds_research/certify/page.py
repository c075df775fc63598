"""The certificate as one self-contained HTML page."""

from __future__ import annotations

import base64
import tempfile
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import Any

from lsds.errors import DataError

_STYLE = """body{font:15px/1.5 sans-serif;max-width:50em;margin:2em auto;padding:0 1em;color:#222}
h1{font-size:1.3em}table{border-collapse:collapse}td,th{padding:.3em .8em;border-bottom:1px solid #ddd;text-align:left}
img{max-width:100%}"""


def write_page(
    path: Path,
    title: str,
    figures: Sequence[dict[str, Any]],
    notes: Sequence[str],
    draw: Callable[[Path], None],
) -> None:
    """Write the page: the figures as a table, the picture, the notes. Raises DataError if it cannot be written."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "certificate.png"
        draw(picture)
        image = base64.b64encode(picture.read_bytes()).decode("ascii")
    rows = "".join(
        f"<tr><td>{escape(row['figure'])}</td><td>{escape(row['value'])}</td><td>{escape(row['range'])}</td></tr>"
        for row in figures
    )
    items = "".join(f"<li>{escape(note)}</li>" for note in notes)
    text = (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{_STYLE}</style></head><body><h1>{escape(title)}</h1>"
        "<p>All figures are simulated. They hold for the ranges that were drawn from, and for a simulated copy of the "
        "rig; a real gel, a real object and a real hand are not part of them.</p>"
        f"<table><tr><th>of a lift</th><th>value</th><th>95 % interval, or range</th></tr>{rows}</table>"
        f'<p><img alt="slip against grip of each lift" src="data:image/png;base64,{image}"></p><ul>{items}</ul>'
        "</body></html>\n"
    )
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise DataError(f"{path}: the page cannot be written: {error}") from error
