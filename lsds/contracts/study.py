"""Contract of a study: something that measures, and may draw what it found. `lsds study NAME` runs it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

Value = str | float | int | bool | None


@dataclass(frozen=True, slots=True)
class StudyTable:
    """`rows` of named values; `columns` says which of them to show, as (key, heading, format)."""

    columns: Sequence[tuple[str, str, str]]
    rows: Sequence[Mapping[str, Value]]


@dataclass(frozen=True, slots=True)
class StudyResult:
    """What a study found.

    `rows` and `columns` are the main table, as in `StudyTable`; it is also what is written as CSV. `more` are further
    tables, shown before it. `draw` writes a PNG; None where there is nothing to draw. `title` says in one line what was
    measured, and that it was simulated where it was. `notes` stand below the tables, `warnings` go to stderr, `details`
    into the JSON.
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
    """What a backend of kind `study` is. Constructing measures nothing."""

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Measure; call `tick(done, whole)` on the way. Raises DataError where its data cannot be read."""
        ...
