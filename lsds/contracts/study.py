"""Contract of a study: something that measures, and can be drawn. `lsds chart NAME` runs it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

Value = str | float | int | bool | None


@dataclass(frozen=True, slots=True)
class StudyResult:
    """`rows` of named values, `columns` of them to be shown as (key, heading, format), `draw` that writes a PNG.

    `title` says in one line what was measured, and that it was simulated where it was; `details` goes into the JSON.
    """

    title: str
    columns: Sequence[tuple[str, str, str]]
    rows: Sequence[Mapping[str, Value]]
    draw: Callable[[Path], None]
    notes: Sequence[str] = ()
    details: Mapping[str, Any] = field(default_factory=dict)


@runtime_checkable
class Study(Protocol):
    """What a backend of kind `study` is. Constructing measures nothing."""

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Measure; call `tick(done, whole)` on the way. Raises DataError where its data cannot be read."""
