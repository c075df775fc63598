"""Overhead of the scheduler, compared with the standard library's `sched`.

Both run the same four-rate rig of empty tasks in simulated time, so the measured time is that of dispatching.
"""

from __future__ import annotations

import sched
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from pydantic import BaseModel, ConfigDict, Field

from lsds.clock import NS_PER_S, VirtualClock, nanoseconds, perf_ns
from lsds.contracts.study import StudyResult, Value
from lsds.runtime.scheduler import Phase, Scheduler

if TYPE_CHECKING:
    from lsds.contracts import BuildContext

RATES_HZ: tuple[tuple[str, float, Phase], ...] = (
    ("force", 500.0, Phase.READ),
    ("arm", 125.0, Phase.COMMAND),
    ("frame", 60.0, Phase.TRACK),
    ("view", 25.0, Phase.OBSERVE),
)
"""The rig measured: name, rate in Hz, phase."""

BUDGET_NS = 50_000_000
"""Limit of the overhead per minute of the rig: less than one thousandth of that time."""


COLUMNS = (
    ("name", "scheduler", ""),
    ("median_ms", "ms for 60 s, median", ".1f"),
    ("best_ms", "best", ".1f"),
    ("dispatch_us", "us a dispatch", ".2f"),
)


class SchedulerOptions(BaseModel):
    """Time the scheduler's own overhead: 60 s of a rig with four rates, next to Python's `sched`.

    Takes: 5 s.

    \b
    Examples:
      lsds study scheduler --json scheduler.json
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    repeats: int = Field(default=5, ge=1, description="runs of each scheduler, alternating")


class SchedulerStudy:
    """A `Study`."""

    def __init__(self, options: SchedulerOptions, context: BuildContext) -> None:
        self.options = options

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Run both schedulers in turns."""
        found = dict(zip(("lsds", "sched"), measure(repeats=self.options.repeats, tick=tick), strict=True))
        rows: list[dict[str, Value]] = [
            {
                "name": name,
                "median_ms": cost.median_ns / 1e6,
                "best_ms": cost.best_ns / 1e6,
                "dispatch_us": cost.per_dispatch_ns / 1e3,
            }
            for name, cost in found.items()
        ]
        return StudyResult(
            "scheduling 60 s of a rig with four rates and empty tasks",
            COLUMNS,
            rows,
            notes=[f"budget: {BUDGET_NS / 1e6:.0f} ms"],
            details={**{name: asdict(cost) for name, cost in found.items()}, "budget_ns": BUDGET_NS},
        )


@dataclass(frozen=True, slots=True)
class SchedulerCost:
    """The best of several repeats, which is the one least disturbed by other processes, and the median.

    `dispatches` are task runs. `bookkeeping` is true if a scheduler keeps statistics, phases and missed cycles.
    """

    name: str
    dispatches: int
    best_ns: int
    median_ns: int
    bookkeeping: bool

    @property
    def per_dispatch_ns(self) -> float:
        """The best total over the dispatches."""
        return self.best_ns / self.dispatches


def measure(
    simulated_s: float = 60.0, repeats: int = 5, tick: Callable[[int, int], None] | None = None
) -> tuple[SchedulerCost, SchedulerCost]:
    """Return the cost of our scheduler and of `sched`, measured in turns so that both see the same machine.

    `tick(done, whole)` is called after each repeat. Raises ValueError if there is nothing to measure.
    """
    if simulated_s <= 0 or repeats < 1:
        raise ValueError("measure at least one repeat of more than 0 s")
    end_ns = nanoseconds(simulated_s)
    ours, peers = [], []
    for done in range(1, repeats + 1):
        ours.append(_run_ours(end_ns))
        peers.append(_run_sched(end_ns))
        if tick is not None:
            tick(done, repeats)
    return (
        _summary("lsds.runtime.scheduler", ours, bookkeeping=True),
        _summary("sched (standard library)", peers, bookkeeping=False),
    )


def _summary(name: str, runs: list[tuple[int, int]], *, bookkeeping: bool) -> SchedulerCost:
    totals = sorted(total for _, total in runs)
    return SchedulerCost(name, runs[0][0], totals[0], totals[len(totals) // 2], bookkeeping)


def _run_ours(end_ns: int) -> tuple[int, int]:
    scheduler = Scheduler(VirtualClock())
    for name, rate_hz, phase in RATES_HZ:
        scheduler.add(name, _nothing, nanoseconds(1 / rate_hz), phase=phase)
    begin = perf_ns()
    scheduler.run(end_ns)
    statistics = scheduler.statistics()
    total = perf_ns() - begin
    return sum(task.runs for task in statistics), total


def _run_sched(end_ns: int) -> tuple[int, int]:
    """Run the naive peer: every event enters its successor, in seconds as `sched` wants them."""
    clock = VirtualClock()
    peer = sched.scheduler(
        lambda: clock.now() / NS_PER_S, lambda s: clock.sleep_until(clock.now() + round(s * NS_PER_S))
    )
    count = 0

    def again(due_ns: int, period_ns: int, phase: int) -> None:
        nonlocal count
        count += 1
        _nothing(due_ns)
        if due_ns + period_ns < end_ns:
            peer.enterabs((due_ns + period_ns) / NS_PER_S, phase, again, (due_ns + period_ns, period_ns, phase))

    for _, rate_hz, phase in RATES_HZ:
        peer.enterabs(0.0, phase, again, (0, nanoseconds(1 / rate_hz), phase))
    begin = perf_ns()
    peer.run()
    return count, perf_ns() - begin


def _nothing(now_ns: int) -> None:
    """Stand for a task that costs nothing."""
