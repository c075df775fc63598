"""One run of a study, recorded: what it reports, prints and returns."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from typing import Any

from lsds.contracts.study import StudyResult, StudyTable
from lsds.errors import LsdsError
from lsds.testing.bench import Bench
from lsds.testing.process_state import global_seed


@dataclass
class Measured:
    """The outcome of a study's `run`. `error` is its exception; `result` is then None."""

    ticks: list[tuple[Any, Any]] = field(default_factory=list)
    printed: str = ""
    result: Any = None
    error: Exception | None = None


_last: list[tuple[Bench, Mapping[str, Any], Measured]] = []
"""The bench that ran last, its options and its run: a study may take minutes, and several checks read one run."""


def measured(bench: Bench) -> Measured:
    """Return the run of a bench's study, the last one if it was with the same options.

    Raises AssertionError if the study raises.
    """
    if not (_last and _last[0][0] is bench and _last[0][1] == bench.options):
        _last[:] = [(bench, dict(bench.options), _run(bench, 1))]
    return _sound(_last[0][2])


def measured_again(bench: Bench) -> Measured:
    """Return a new run, with other global random numbers. Raises AssertionError if the study raises."""
    return _sound(_run(bench, 2))


def result_of(bench: Bench) -> StudyResult:
    """Return the result of a run. Raises AssertionError if it is no StudyResult, which another check reports, too."""
    result = measured(bench).result
    assert isinstance(result, StudyResult), (
        f"run() returned {type(result).__name__}; return lsds.contracts.StudyResult(title, columns, rows)"
    )
    return result


def tables_of(bench: Bench) -> Iterator[tuple[str, Sequence[Any], Sequence[Any]]]:
    """Yield the name, columns and rows of each table of a result; its own one has the name ""."""
    result = result_of(bench)
    yield "", result.columns, result.rows
    for i, part in enumerate(result.more):
        assert isinstance(part, StudyTable), (
            f"more[{i}] is {type(part).__name__}; write lsds.contracts.StudyTable(columns, rows)"
        )
        yield f"more[{i}], ", part.columns, part.rows


def _run(bench: Bench, seed: int) -> Measured:
    run, printed = Measured(), io.StringIO()
    with global_seed(seed), redirect_stdout(printed):
        study = bench.build()
        try:
            run.result = study.run(lambda done, whole: run.ticks.append((done, whole)))
        except Exception as error:
            run.error = error
    run.printed = printed.getvalue()
    return run


def _sound(run: Measured) -> Measured:
    if run.error is not None:
        known = isinstance(run.error, LsdsError)
        remedy = "set options with which it runs (--set KEY=VALUE)" if known else "raise DataError for data"
        raise AssertionError(f"run() raised {type(run.error).__name__}: {run.error}; {remedy}") from run.error
    return run
