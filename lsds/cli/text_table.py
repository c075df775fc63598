"""Tables as text that fit the terminal: wide cells are wrapped; what is still too wide is written row by row."""

from __future__ import annotations

import os
import shutil
import sys
import textwrap
from collections.abc import Sequence

GAP = "  "
"""Space between two columns."""
NARROWEST = 14
"""Least width to which a column of text is wrapped, characters: a longer word is cut."""


def table(rows: Sequence[tuple[str, ...]], header: tuple[str, ...], width: int | None = None) -> str:
    """Return rows as text in aligned columns of at most `width` characters; default: that of the terminal.

    Output that is no terminal has no limit, unless the environment variable COLUMNS states one.
    """
    limit = _terminal_width() if width is None else width
    natural = [max(len(row[i]) for row in [header, *rows]) for i in range(len(header))]
    widths = natural if limit is None else _fitted(natural, rows, header, limit)
    if widths is None:
        return _records(rows, header, limit or 0)
    lines = []
    for row in [header, *rows]:
        cells = [textwrap.wrap(cell, max(width, 1)) or [""] for cell, width in zip(row, widths, strict=True)]
        for at in range(max(map(len, cells))):
            parts = [cell[at] if at < len(cell) else "" for cell in cells]
            lines.append(GAP.join(f"{part:{width}}" for part, width in zip(parts, widths, strict=True)))
        if row is header:
            lines.append(GAP.join("-" * width for width in widths))
    return "\n".join(line.rstrip() for line in lines)


def _terminal_width() -> int | None:
    if sys.stdout.isatty():
        return shutil.get_terminal_size().columns
    stated = os.environ.get("COLUMNS", "")
    return int(stated) if stated.isdecimal() and int(stated) > 0 else None


def _fitted(
    natural: Sequence[int], rows: Sequence[tuple[str, ...]], header: tuple[str, ...], limit: int
) -> list[int] | None:
    """Return the widths of the columns, the widest columns of text shrunk; None if the limit is too small."""
    widths = list(natural)
    least = [
        NARROWEST if any(" " in row[i] for row in [header, *rows]) and width > NARROWEST else width
        for i, width in enumerate(natural)
    ]
    room = limit - len(GAP) * (len(widths) - 1)
    while sum(widths) > room:
        at = max(range(len(widths)), key=lambda i: widths[i] - least[i])
        if widths[at] <= least[at]:
            return None
        widths[at] -= 1
    return widths


def _records(rows: Sequence[tuple[str, ...]], header: tuple[str, ...], limit: int) -> str:
    """Return each row as lines of "name: value"."""
    blocks = []
    for row in rows:
        lines = []
        for name, cell in zip(header, row, strict=True):
            if cell:
                text = f"{name}: {cell}" if name else cell
                lines += textwrap.wrap(text, max(limit, NARROWEST), subsequent_indent=GAP)
        blocks.append("\n".join(lines))
    return "\n\n".join(blocks)
