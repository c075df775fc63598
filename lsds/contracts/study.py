"""Contract of a study: a measurement with a table and optionally a picture. `lsds study NAME` runs it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

Value = str | float | int | bool | None


@dataclass(frozen=True, slots=True)
class StudyTable:
    """A table: `rows` of named values; `columns` selects those to show, as (key, heading, format)."""

    columns: Sequence[tuple[str, str, str]]
    rows: Sequence[Mapping[str, Value]]


@dataclass(frozen=True, slots=True)
class StudyResult:
    """The result of a study.

    `rows` and `columns` are the main table, as in `StudyTable`; it is also written as CSV. `more` are further tables,
    printed before it. `draw` writes a PNG; None if there is nothing to draw. `title` states in one line what was
    measured, and that it was simulated if so. `notes` are printed below the tables, `warnings` go to stderr, `details`
    to the JSON. The page of `--report` plots the rows, or `details["runs"]` where that is a list of single runs.
    """

    title: str
    columns: Sequence[tuple[str, str, str]]
    rows: Sequence[Mapping[str, Value]]
    draw: Callable[[Path], None] | None = None
    notes: Sequence[str] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    more: Sequence[StudyTable] = ()
    warnings: Sequence[str] = ()


@runtime_checkable
class Study(Protocol):
    """The interface of a backend of kind `study`. Constructing measures nothing: no file, no thread, little time.

    With an option `seed`, the same seed gives the same rows. A study that measures times may name their keys in an
    attribute `timed`, a collection of texts; these cells differ from run to run.
    """

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Measure; call `tick(done, whole)` after each part, until done is whole. Prints nothing.

        Raises DataError if its data cannot be read.
        """
        ...
