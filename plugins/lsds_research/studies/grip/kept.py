"""The file that keeps runs, one JSON object a line: a study goes on where it ended."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from lsds.errors import DataError

Row = dict[str, Any]


def read_kept(path: Path | None) -> dict[str, Row]:
    """Return the runs that are kept already. Raises DataError for a file that is no such list."""
    if path is None or not path.exists():
        return {}
    found: dict[str, Row] = {}
    lines = path.read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines, start=1):
        try:
            item = json.loads(line)
            found[item["key"]] = item["run"]
        except (json.JSONDecodeError, TypeError, KeyError) as error:
            # A run that was cut off while it was written is the last line.
            if number == len(lines):
                break
            raise DataError(f"{path}, line {number}: no run that was kept (choose another file)") from error
    return found


def keep(path: Path | None, key: str, row: Row) -> None:
    """Add a run to the file; None keeps nothing. Raises DataError where it cannot be written."""
    if path is None:
        return
    try:
        text = path.read_text(encoding="utf-8") if path.exists() else ""
        with path.open("a", encoding="utf-8") as file:
            file.write(("\n" if text and not text.endswith("\n") else "") + json.dumps({"key": key, "run": row}) + "\n")
    except OSError as error:
        raise DataError(f"{path}: cannot be written: {error}") from error
