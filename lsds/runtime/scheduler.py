"""Several rates in one thread: a heap of (due, phase, order), absolute deadlines, missed cycles skipped.

Every task has a fixed grid, first due + k * period. A cycle that could not run in time is skipped and counted, so that
rates do not drift and no backlog builds up.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from heapq import heapify, heapreplace

from lsds.clock import Clock, perf_ns
from lsds.runtime.histogram import LogHistogram

_HISTOGRAM_BATCH = 512
"""Execution times are added to the histogram in batches of this size, which is faster than one at a time."""


class Phase(IntEnum):
    """The order of tasks that are due at the same time: data flows from sensing to acting."""

    READ = 0
    TRACK = 1
    FEATURES = 2
    DETECT = 3
    ESTIMATE = 4
    CONTROL = 5
    COMMAND = 6
    OBSERVE = 7


@dataclass(frozen=True, slots=True)
class TaskStatistics:
    """Statistics of one task. `runs + overruns` is the number of its cycles that were due.

    `overruns` counts missed cycles. Lateness is the time from due to start on the scheduler's clock; execution times
    are measured with a high-resolution counter, quantiles to 1.6 %. If a task starts without waiting, its execution
    time includes dispatching, about half a microsecond. All in nanoseconds.
    """

    name: str
    period_ns: int
    runs: int
    overruns: int
    max_lateness_ns: int
    mean_ns: float
    p50_ns: float
    p99_ns: float
    max_ns: int


class _Task:
    __slots__ = ("callback", "histogram", "max_lateness_ns", "name", "overruns", "period_ns", "samples")

    def __init__(self, name: str, callback: Callable[[int], object], period_ns: int) -> None:
        self.name = name
        self.callback = callback
        self.period_ns = period_ns
        self.overruns = 0
        self.max_lateness_ns = 0
        self.samples: list[int] = []
        self.histogram = LogHistogram()

    def fold(self) -> None:
        self.histogram.add(self.samples)
        self.samples.clear()

    def statistics(self) -> TaskStatistics:
        self.fold()
        h = self.histogram
        return TaskStatistics(
            self.name,
            self.period_ns,
            runs=h.count,
            overruns=self.overruns,
            max_lateness_ns=self.max_lateness_ns,
            mean_ns=h.mean,
            p50_ns=h.quantile(0.5),
            p99_ns=h.quantile(0.99),
            max_ns=h.maximum,
        )


class Scheduler:
    """Runs periodic tasks on one clock, in one thread.

    Tasks due at the same time run in order of phase, then in the order in which they were added. The grids of all
    tasks begin at the time of the first `run`.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._tasks: list[_Task] = []
        self._waiting: list[tuple[int, int, int, _Task]] = []
        self._heap: list[tuple[int, int, int, _Task]] = []
        self._epoch_ns: int | None = None
        self._running = False
        self._stop_requested = False

    def add(
        self,
        name: str,
        callback: Callable[[int], object],
        period_ns: int,
        *,
        phase: Phase | int,
        offset_ns: int = 0,
    ) -> None:
        """Add a task: `callback(now_ns)` every `period_ns`, first `offset_ns` after the first `run` began.

        Not while running. Raises ValueError for a period below 1 ns, a negative offset or a name in use, RuntimeError
        while running.
        """
        if self._running:
            raise RuntimeError(f"cannot add task '{name}' while the scheduler runs")
        if period_ns < 1 or offset_ns < 0:
            raise ValueError(f"task '{name}': the period must be at least 1 ns and the offset not negative")
        if any(task.name == name for task in self._tasks):
            raise ValueError(f"a task named '{name}' already exists")
        task = _Task(name, callback, period_ns)
        self._waiting.append((offset_ns, int(phase), len(self._tasks), task))
        self._tasks.append(task)

    def stop(self) -> None:
        """Make `run` return before the next task starts; from any thread. If it is not running, the next `run` returns
        at once."""
        self._stop_requested = True

    def statistics(self) -> tuple[TaskStatistics, ...]:
        """Return the statistics of each task, in the order in which they were added."""
        return tuple(task.statistics() for task in self._tasks)

    def clear(self) -> None:
        """Let go of all tasks, and so of whatever they hold; their statistics stay. Nothing runs after that."""
        self._heap.clear()
        self._waiting.clear()
        for task in self._tasks:
            task.callback = _nothing

    def run(self, until_ns: int) -> bool:
        """Run every task that is due before `until_ns`, then sleep until that time. Return False if `stop` ended it.

        May be called again to continue. An exception of a task ends the run and propagates, with the task's name as a
        note and the task counted. Raises RuntimeError from within a task.
        """
        if self._running:
            raise RuntimeError("the scheduler is already running")
        self._take_waiting()
        self._running = True
        try:
            reached = self._dispatch(until_ns)
        finally:
            self._running = False
        if reached:
            self._clock.sleep_until(until_ns)
        else:
            self._stop_requested = False
        return reached

    def _take_waiting(self) -> None:
        now = self._clock.now()
        if self._epoch_ns is None:
            self._epoch_ns = now
        for offset, phase, order, task in self._waiting:
            due = self._epoch_ns + offset
            if due < now:  # A task added after the first run starts at the next point of its grid.
                due += -(-(now - due) // task.period_ns) * task.period_ns
            self._heap.append((due, phase, order, task))
        self._waiting.clear()
        heapify(self._heap)

    def _dispatch(self, until_ns: int) -> bool:
        """Run the heap. This loop runs some thousand times per second: it uses locals and avoids calls."""
        heap = self._heap
        clock_now = self._clock.now
        sleep_until = self._clock.sleep_until
        replace = heapreplace
        counter = perf_ns
        now = clock_now()
        started = counter()
        while heap:
            due, phase, order, task = heap[0]
            if due >= until_ns:
                return True
            if self._stop_requested:
                return False
            if now < due:
                sleep_until(due)
                now = clock_now()
                started = counter()
            if now - due > task.max_lateness_ns:
                task.max_lateness_ns = now - due
            samples = task.samples
            try:
                task.callback(now)
            except BaseException as error:
                samples.append(counter() - started)
                error.add_note(f"raised by task '{task.name}', due at {due} ns")
                replace(heap, (self._next_due(due, task), phase, order, task))
                raise
            ended = counter()
            samples.append(ended - started)
            started = ended
            if len(samples) >= _HISTOGRAM_BATCH:
                task.fold()
                started = counter()
            now = clock_now()
            next_due = due + task.period_ns
            if next_due <= now:
                next_due = self._next_due(due, task)
            replace(heap, (next_due, phase, order, task))
        return True

    def _next_due(self, due: int, task: _Task) -> int:
        """Return the first point of the task's grid that is after the present, counting those missed on the way."""
        missed = max((self._clock.now() - due) // task.period_ns, 0)
        task.overruns += missed
        return due + (missed + 1) * task.period_ns


def _nothing(now_ns: int) -> None:
    """The callback of a cancelled task."""
