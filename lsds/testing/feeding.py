"""Builds an algorithm of each kind and feeds it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import pytest

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext, Wanted
from lsds.contracts.kinds import Kind
from lsds.errors import ConfigError, SafetyStop
from lsds.testing.bench import Bench
from lsds.testing.comparing import plain
from lsds.testing.gel import SPEC
from lsds.testing.grips import grip_inputs
from lsds.testing.situations import setting, situations
from lsds.testing.stimulus import frames, observations, rest_frame

ENDED = "the run has ended"
"""The answer of a job that is done or has stopped, to all further inputs."""


@dataclass(frozen=True)
class Course:
    """How to feed a kind: functions that begin and clear an instance and pass it an input, and two input sequences."""

    begin: Callable[[Any], object]
    clear: Callable[[Any], object]
    feed: Callable[[Any, Any], Any]
    first: Callable[[], Sequence[Any]]
    second: Callable[[], Sequence[Any]]


def build(bench: Bench, clock_ns: int = 0, seed: int = 0) -> Any:
    """Return a new instance, begun, with a stopped clock. Skips the check if a job refuses the kit's rig."""
    context = BuildContext(VirtualClock(clock_ns), seed)
    algorithm = bench.host.build(bench.kind, bench.name, bench.options, context)
    try:
        COURSES[bench.kind].begin(algorithm)
    except ConfigError as error:
        pytest.skip(f"{bench.kind} {bench.name!r} refuses the rig of the kit: {error}")
    return algorithm


def answers(bench: Bench, algorithm: Any, inputs: Iterable[Any]) -> list[Any]:
    """Return the plain answers to inputs, copied at once. Raises AssertionError for an answer that is an exception."""
    return [plain(answer) for answer in raw_answers(bench, algorithm, inputs)]


def raw_answers(bench: Bench, algorithm: Any, inputs: Iterable[Any]) -> Iterable[Any]:
    """Yield the answers to inputs, up to the end of a job. Raises AssertionError if the algorithm raises."""
    course = COURSES[bench.kind]
    for i, item in enumerate(inputs):
        try:
            answer = course.feed(algorithm, item)
        except Exception as error:
            raise AssertionError(
                f"{bench.kind} {bench.name!r} raised {type(error).__name__} on input {i}: {error}; "
                "an algorithm answers every sound input (abstain where it cannot decide)"
            ) from error
        yield answer
        if answer is ENDED or (isinstance(answer, Wanted) and answer.done):
            return


def _update(algorithm: Any, item: Any) -> Any:
    return algorithm.update(item)


def _correct(controller: Any, given: Any) -> Any:
    return controller.update(*given)


def _reset(algorithm: Any) -> None:
    algorithm.reset()


def _start(tracker: Any) -> None:
    tracker.start(rest_frame(), SPEC.pad)


def _begin(job: Any) -> None:
    job.begin(setting())


def _step(job: Any, situation: Any) -> Any:
    try:
        return job.step(situation)
    except SafetyStop:
        return ENDED


def _nothing(algorithm: Any) -> None:
    return None


COURSES: dict[Kind, Course] = {
    "detector": Course(_nothing, _reset, _update, lambda: observations("slides"), lambda: observations("turns")),
    "estimator": Course(_nothing, _reset, _update, lambda: observations("slides"), lambda: observations("turns")),
    "tracker": Course(_start, _reset, _update, lambda: frames("slides"), lambda: frames("turns")),
    "controller": Course(_nothing, _reset, _correct, lambda: grip_inputs("slides"), lambda: grip_inputs("turns")),
    "job": Course(_begin, _begin, _step, lambda: situations(0.05), lambda: situations(0.02)),
}
"""Every kind of algorithm that has checks."""
