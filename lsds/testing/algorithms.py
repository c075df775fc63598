"""Checks of every kind of algorithm: detector, estimator, tracker, controller, job.

An algorithm is a function of its inputs since the last reset, and of nothing else.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from statistics import median
from typing import Any

import numpy as np

from lsds.clock import perf_ns
from lsds.testing.bench import Bench
from lsds.testing.comparing import first_difference, plain
from lsds.testing.feeding import COURSES, answers, build, raw_answers
from lsds.testing.process_state import changes_by, global_seed
from lsds.testing.stimulus import FRAME_NS
from lsds.testing.traces import clock_calls, io_calls

LATER_NS = 10**15
"""Time of a clock that differs from the first one's, ns."""


def check_reset_equals_a_new_build(bench: Bench) -> None:
    """After any sequence, `reset` (`begin` of a job) clears all state: the next answers are those of a new build."""
    course, used = COURSES[bench.kind], build(bench)
    answers(bench, used, course.first())
    course.clear(used)
    difference = first_difference(answers(bench, used, course.second()), answers(bench, build(bench), course.second()))
    clears = "begin()" if bench.kind == "job" else "reset()"
    assert not difference, (
        f"after {clears} the answers are not those of a new build: {difference}; set every attribute that an input "
        f"changes in {clears}"
    )


def check_is_deterministic(bench: Bench) -> None:
    """Two builds give the same answers to the same inputs, whatever global random state and clock are."""
    inputs = COURSES[bench.kind].first()
    with global_seed(1):
        one = answers(bench, build(bench), inputs)
    with global_seed(2):
        other = answers(bench, build(bench, clock_ns=LATER_NS), inputs)
    difference = first_difference(one, other)
    assert not difference, (
        f"two builds answer the same inputs differently: {difference}; use numpy.random.default_rng with "
        "context.rng_seed(...), and the times of the inputs instead of a clock"
    )


def check_answers_do_not_change_later(bench: Bench) -> None:
    """Answers depend on no later input: those to a prefix are the same, and none changes after it was returned."""
    inputs = COURSES[bench.kind].first()
    kept, copies = [], []
    for answer in raw_answers(bench, build(bench), inputs):
        kept.append(answer)
        copies.append(plain(answer))
    difference = first_difference(copies, [plain(answer) for answer in kept])
    assert not difference, f"an answer changed after it was returned: {difference}; return new arrays every time"
    half = len(inputs) // 2
    prefix = answers(bench, build(bench), inputs[:half])
    difference = first_difference(prefix, copies[:half])
    assert not difference, f"the answers to the first {half} inputs depend on what follows: {difference}; use the past"


def check_instances_share_nothing(bench: Bench) -> None:
    """Two instances that are fed in turn answer as each does alone."""
    course = COURSES[bench.kind]
    alone = [answers(bench, build(bench), inputs) for inputs in (course.first(), course.second())]
    runs = [iter(raw_answers(bench, build(bench), inputs)) for inputs in (course.first(), course.second())]
    together: list[list[Any]] = [[], []]
    for _ in range(max(map(len, alone))):
        for run, found in zip(runs, together, strict=True):
            found.extend(plain(answer) for answer in _next(run))
    for one, other in zip(together, alone, strict=True):
        difference = first_difference(one, other)
        assert not difference, (
            f"an instance answers differently next to another one: {difference}; keep state in the instance, "
            "not in the class or the module"
        )


def check_leaves_global_state(bench: Bench) -> None:
    """Global random generators, error state, logging, working folder, environment and threads stay as they are."""
    course = COURSES[bench.kind]

    def live() -> None:
        used = build(bench)
        answers(bench, used, course.first())
        course.clear(used)

    changes = changes_by(live)
    assert not changes.state, (
        f"building, feeding and clearing it changed {', '.join(changes.state)}; draw from "
        "numpy.random.default_rng(context.rng_seed(...)), use `with numpy.errstate(...)` and "
        "logging.getLogger(__name__), and leave the process as it is"
    )
    assert not changes.threads, (
        f"building, feeding and clearing it started {', '.join(map(str, changes.threads))}; answer in the caller's "
        "thread"
    )


def check_leaves_its_inputs(bench: Bench) -> None:
    """No array of an input is modified."""
    inputs = [writable(item) for item in COURSES[bench.kind].first()]
    algorithm, before = build(bench), [_bytes(item) for item in inputs]
    answers(bench, algorithm, inputs)
    for i, (item, was) in enumerate(zip(inputs, before, strict=True)):
        changed = [name for name, content in _bytes(item).items() if content != was[name]]
        assert not changed, f"input {i}: it modified {', '.join(changed)}; work on a copy, others read the same arrays"


def check_answers_in_time(bench: Bench) -> None:
    """The median time of an answer is below the frame interval, 40 ms at 25 Hz."""
    course, algorithm = COURSES[bench.kind], build(bench)
    durations = []
    inputs = course.first()
    # A job is asked more often than there are frames: a sample of its steps is enough.
    for item in inputs[:: max(1, len(inputs) // 60)]:
        began = perf_ns()
        course.feed(algorithm, item)
        durations.append(perf_ns() - began)
    taken_ms, limit_ms = median(durations) * 1e-6, FRAME_NS * 1e-6
    assert taken_ms < limit_ms, (
        f"the median answer takes {taken_ms:.0f} ms, and frames come every {limit_ms:.0f} ms; move loading, training "
        "and waiting to the constructor or out of it"
    )


def check_answering_does_no_io(bench: Bench) -> None:
    """Answering opens no file, socket or process."""
    inputs = COURSES[bench.kind].first()
    answers(bench, build(bench), inputs)  # Imports at the first use are not counted.
    algorithm = build(bench)
    with io_calls() as calls:
        answers(bench, algorithm, inputs)
    assert not calls, f"answering accessed {calls[0]} ({len(calls)} accesses); read files in the constructor"


def check_answering_reads_no_clock(bench: Bench) -> None:
    """Answering reads no clock: the time is that of the inputs."""
    inputs = COURSES[bench.kind].first()
    algorithm = build(bench)
    with clock_calls() as calls:
        answers(bench, algorithm, inputs)
    assert not calls, f"answering reads a clock: {calls[0]} ({len(calls)} calls); use t_ns and dt_s of the input"


def _next(run: Iterator[Any]) -> Sequence[Any]:
    try:
        return [next(run)]
    except StopIteration:
        return []


def writable(item: Any) -> Any:
    """Return a copy of an input whose arrays are its own and may be written to."""
    if isinstance(item, np.ndarray):
        return item.copy()
    if isinstance(item, tuple) and type(item) is tuple:
        return tuple(map(writable, item))
    if not dataclasses.is_dataclass(item) or isinstance(item, type):
        return item
    fields = {field.name: writable(getattr(item, field.name)) for field in dataclasses.fields(item)}
    return dataclasses.replace(item, **fields) if type(item).__module__.startswith("lsds.contracts") else item


def _bytes(item: Any, path: str = "") -> dict[str, Any]:
    """Return the content of every array of an input, by its name."""
    if isinstance(item, np.ndarray):
        return {path: (item.shape, item.tobytes())}
    if isinstance(item, tuple):
        parts = {str(i): part for i, part in enumerate(item)}
    elif dataclasses.is_dataclass(item) and not isinstance(item, type):
        parts = {field.name: getattr(item, field.name) for field in dataclasses.fields(item)}
    else:
        return {}
    return {key: value for name, part in parts.items() for key, value in _bytes(part, f"{path}.{name}").items()}


ALGORITHM_CHECKS = (
    check_reset_equals_a_new_build,
    check_is_deterministic,
    check_answers_do_not_change_later,
    check_instances_share_nothing,
    check_leaves_global_state,
    check_leaves_its_inputs,
    check_answers_in_time,
    check_answering_does_no_io,
    check_answering_reads_no_clock,
)
