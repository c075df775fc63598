"""A file of runs, one JSON object a line, from which an interrupted study continues."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, BinaryIO, Protocol, TypeVar

from lsds.errors import DataError
from lsds.registry.containment import one_line
from lsds.support.processes import DIED
from lsds_research.cluster import shared_out
from lsds_research.code_digest import code_digest

Row = dict[str, Any]

_BEGINS = '{"key": "'
"""Beginning of each stored line."""
_BLOCK = 65536
"""Number of bytes that are read at once when looking for the end of the last whole line."""


class Keyed(Protocol):
    """Work whose result is stored under a key."""

    @property
    def key(self) -> str:
        """The key; it contains everything that the result depends on."""
        ...


Item = TypeVar("Item", bound=Keyed)


def run_and_store(
    work: Callable[[Item], Row | str],
    items: Sequence[Item],
    out: str,
    jobs: int,
    cluster: str,
    tick: Callable[[int, int], None],
) -> tuple[dict[str, Row], dict[str, str]]:
    """Run the items that the file `out` lacks, and add them to it; "" stores nothing.

    Returns the rows by key, in the order of the items, and the reason for each item that failed: the text that `work`
    returned. Raises DataError for a file or a cluster that cannot be used.
    """
    kept = Path(out) if out else None
    known = read_runs(kept)
    missing = [each for each in items if each.key not in known]
    failures: dict[str, str] = {}
    begun = len(items) - len(missing)
    for done, (what, result) in enumerate(shared_out(work, missing, jobs, cluster), start=begun + 1):
        if isinstance(result, dict):
            known[what.key] = result
            add_run(kept, what.key, result)
        else:
            failures[what.key] = result or DIED
        tick(done, len(items))
    rows = {each.key: known[each.key] for each in items if each.key in known}
    return rows, failures


def read_runs(path: Path | None) -> dict[str, Row]:
    """Return the runs in a file; warns of runs by other code. Raises DataError for a file of another format."""
    if path is None:
        return {}
    if not path.exists():
        # Before the runs, which may take hours.
        if not (path.parent.is_dir() and os.access(path.parent, os.W_OK)):
            raise DataError(f"{path}: cannot be written: there is no such folder, or it is not yours to write in")
        return {}
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{path}: cannot be read as stored runs: {one_line(error)} (choose another file)") from error
    found: dict[str, Row] = {}
    others = 0
    lines = text.split("\n")
    cut = lines.pop()
    for number, line in enumerate(lines, start=1):
        try:
            item = json.loads(line)
            key, row = item["key"], item["run"]
            if not (isinstance(key, str) and isinstance(row, dict) and row):
                raise TypeError("a run is a table with a key")
        except (json.JSONDecodeError, TypeError, KeyError) as error:
            raise DataError(f"{path}, line {number}: not a stored run (choose another file)") from error
        found[key] = row
        others += item.get("code") != code_digest()
    # An interrupted write leaves a beginning of a line.
    if cut[: len(_BEGINS)] != _BEGINS[: len(cut)]:
        raise DataError(f"{path}, line {len(lines) + 1}: not a stored run (choose another file)")
    if others:
        text = f"{path}: {others} of {len(found)} runs were stored by another version of the code"
        warnings.warn(f"{text} and are counted alike; choose another file for one version alone", stacklevel=2)
    return found


def add_run(path: Path | None, key: str, row: Row) -> None:
    """Append a run to the file; None stores nothing. Raises DataError if it cannot be written."""
    if path is None:
        return
    try:
        with path.open("a+b") as file:
            _remove_cut_line(file)
            file.write(json.dumps({"key": key, "run": row, "code": code_digest()}).encode() + b"\n")
    except OSError as error:
        raise DataError(f"{path}: cannot be written: {error}") from error


def _remove_cut_line(file: BinaryIO) -> None:
    """Remove what an interrupted write has left behind the last whole line."""
    end = file.seek(0, os.SEEK_END)
    at = end
    while at:
        before = max(0, at - _BLOCK)
        file.seek(before)
        last = file.read(at - before).rfind(b"\n")
        if last >= 0:
            at = before + last + 1
            break
        at = before
    if at < end:
        file.truncate(at)
