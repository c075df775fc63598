"""Checks of studies: constructing is free, progress reaches its end, and the result can be shown, written and drawn."""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lsds.clock import WallClock, perf_ns, seconds
from lsds.contracts.backend import BuildContext
from lsds.errors import MissingExtra
from lsds.registry.containment import diverted
from lsds.registry.options import validated
from lsds.support.extras import explained
from lsds.support.numeric import is_whole
from lsds.testing.audit import audited
from lsds.testing.bench import Bench
from lsds.testing.comparing import alike
from lsds.testing.lifecycle import described
from lsds.testing.measured import measured, measured_again, result_of, tables_of
from lsds.testing.outcomes import NotApplicable

BUILT_S = 1.0
"""Maximum time of constructing a study, without its imports, s."""
PNG = b"\x89PNG\r\n\x1a\n"
CELLS = (str, float, int, bool, type(None))


def check_constructing_measures_nothing(bench: Bench) -> None:
    """Constructing opens no file, socket or process, starts no thread and takes less than 1 s."""
    bench.build()  # Once before, so that lazy imports of the factory are not counted.
    backend = bench.host.find(bench.kind, bench.name)
    factory, model = bench.host.imported(backend), bench.host.options_model(backend)
    options = None if model is None else validated(model, bench.options, bench.name)
    context = BuildContext(WallClock())
    threads, began = set(threading.enumerate()), perf_ns()
    # The factory alone is called: the host opens files on its own.
    with diverted(), audited(_opened) as calls:
        factory(options, context)
    taken_s, started = seconds(perf_ns() - began), set(threading.enumerate()) - threads
    assert not calls, f"the constructor accessed {calls[0]} ({len(calls)} accesses); open it in run()"
    assert not started, f"constructing started {', '.join(map(str, started))}; start it in run()"
    assert taken_s < BUILT_S, f"constructing took {taken_s:.1f} s, at most {BUILT_S:.0f} s is allowed; measure in run()"


def check_progress_reaches_its_end(bench: Bench) -> None:
    """`run` calls `tick(done, whole)` with whole numbers; done rises to whole, after which a further part may begin."""
    ticks = measured(bench).ticks
    assert ticks, "run() never called tick(); call tick(done, whole) after each part, at the end with done == whole"
    before, end = 0, 0
    for i, (done, whole) in enumerate(ticks):
        at = f"call {i}: tick({done!r}, {whole!r})"
        assert is_whole(done) and is_whole(whole), f"{at}: both are whole numbers; count parts, not shares"  # noqa: PT018
        assert 0 <= done <= whole, f"{at}: done is between 0 and whole; count all parts in whole"
        assert done >= before or before == end, f"{at} after {before} of {end}: done falls; count what is done"
        before, end = done, whole
    assert before == end > 0, f"the last call is tick({before}, {end}); call tick(whole, whole) at the end"


def check_prints_nothing(bench: Bench) -> None:
    """`run` writes nothing to stdout, where `lsds study NAME --json -` writes the result."""
    printed = measured(bench).printed.strip()
    assert not printed, f"run() printed {printed[:80]!r}; return text as notes or warnings of the StudyResult"


def check_result_has_a_title(bench: Bench) -> None:
    """`run` returns a StudyResult with a title of one line, and with notes and warnings that are texts."""
    result = result_of(bench)
    title: Any = result.title
    assert isinstance(title, str) and title.strip(), f"title is {title!r}; state in one line what was measured"  # noqa: PT018
    assert len(title.splitlines()) == 1, f"title {title!r} has several lines; use one, and `notes` for the rest"
    for name in ("notes", "warnings"):
        texts: Any = getattr(result, name)
        assert isinstance(texts, Sequence) and not isinstance(texts, str), f"{name} is {texts!r}; return a list"  # noqa: PT018
        wrong = [text for text in texts if not isinstance(text, str)]
        assert not wrong, f"{name} holds {wrong[0]!r}; return texts"


def check_columns_are_named(bench: Bench) -> None:
    """Each column is (key, heading, format), three texts, and no key comes twice."""
    for table, columns, _ in tables_of(bench):
        assert len(columns) > 0, f"{table}there are no columns; name those to show as (key, heading, format)"
        for i, column in enumerate(columns):
            texts = isinstance(column, tuple | list) and len(column) == 3 and all(isinstance(x, str) for x in column)
            assert texts, f"{table}column {i} is {column!r}; write (key, heading, format), such as ('t_s', 's', '.1f')"
        keys = [column[0] for column in columns]
        twice = sorted({key for key in keys if keys.count(key) > 1})
        assert not twice, f"{table}two columns have the key {twice[0]!r}; give each its own"


def check_rows_have_a_cell_for_each_column(bench: Bench) -> None:
    """Each row maps the key of every column to a text, number, bool or None; further keys are written, not shown."""
    for table, columns, rows in tables_of(bench):
        for i, row in enumerate(rows):
            assert isinstance(row, Mapping), f"{table}row {i} is {type(row).__name__}; return a dict by key"
            lacking = [column[0] for column in columns if column[0] not in row]
            assert not lacking, (
                f"{table}row {i} has no {', '.join(map(repr, lacking))}; write None if there is no value"
            )
            for key, cell in row.items():
                assert isinstance(cell, CELLS), (
                    f"{table}row {i}: {key!r} is {type(cell).__name__} {cell!r}; return str, float, int, bool or None"
                )


def check_formats_fit_the_rows(bench: Bench) -> None:
    """The format of each column can be applied to every cell in it."""
    for table, columns, rows in tables_of(bench):
        for i, row in enumerate(rows):
            for key, _, form in columns:
                cell = row.get(key)
                if cell is None or isinstance(cell, bool):
                    continue  # They are shown as "-", "yes" and "no".
                try:
                    format(cell, form)
                except (ValueError, TypeError) as error:
                    raise AssertionError(
                        f"{table}row {i}: {key!r} is {cell!r}, which the format {form!r} does not take: {error}; use "
                        "'' for text, '.2f' for floats, 'd' for whole numbers"
                    ) from error


def check_draws_a_png(bench: Bench) -> None:
    """`draw(path)` writes a PNG, and no other file next to it."""
    draw = result_of(bench).draw
    if draw is None:
        raise NotApplicable("it draws nothing")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "picture.png"
        try:
            draw(path)
        except (MissingExtra, ModuleNotFoundError) as error:
            missing = error if isinstance(error, MissingExtra) else explained(error)
            if missing is None:
                raise
            raise NotApplicable(f"drawing needs a library: {missing}") from error
        names = sorted(file.name for file in Path(folder).iterdir())
        assert path.name in names, f"draw({path.name!r}) wrote {names or 'nothing'}; write to the path that it is given"
        assert names == [path.name], f"draw() wrote {', '.join(names)}; write the one file that it is given"
        begin = path.read_bytes()[:16]
    assert begin.startswith(PNG), f"draw() wrote a file that begins with {begin!r}; write a PNG"


def check_same_seed_same_rows(bench: Bench) -> None:
    """With an option `seed`, two runs give the same rows, but for the keys in `timed`, which are measured times."""
    backend = bench.host.find(bench.kind, bench.name)
    model = bench.host.options_model(backend)
    if model is None or "seed" not in model.model_fields:
        raise NotApplicable("it has no option seed")
    timed = set(getattr(bench.build(), "timed", ()))
    result_of(bench)
    ones, others = measured(bench).result.rows, measured_again(bench).result.rows
    assert len(ones) == len(others), f"two runs give {len(ones)} and {len(others)} rows; draw from the seed alone"
    for i, (one, other) in enumerate(zip(ones, others, strict=True)):
        for key in dict.fromkeys([*one, *other]):
            if key not in timed:
                same = alike(one.get(key), other.get(key))
                assert same, (
                    f"row {i}: {key!r} is {one.get(key)!r} in one run and {other.get(key)!r} in another; use "
                    "numpy.random.default_rng(options.seed), or name the keys of measured times in `timed`"
                )


def _opened(event: str, arguments: tuple[Any, ...]) -> str:
    return f"open {arguments[0]}" if event == "open" else described(event, arguments)


STUDY_CHECKS = (
    check_constructing_measures_nothing,
    check_progress_reaches_its_end,
    check_prints_nothing,
    check_result_has_a_title,
    check_columns_are_named,
    check_rows_have_a_cell_for_each_column,
    check_formats_fit_the_rows,
    check_draws_a_png,
    check_same_seed_same_rows,
)
