from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from lsds.clock import VirtualClock
from lsds.runtime.histogram import LogHistogram
from lsds.runtime.scheduler import Scheduler

periods = st.integers(1, 400)


@given(st.lists(st.tuples(periods, st.integers(0, 8), st.integers(0, 500)), min_size=1, max_size=5), st.integers(0, 99))
def test_no_drift(tasks, start):
    clock = VirtualClock(start)
    scheduler = Scheduler(clock)
    times = [[] for _ in tasks]
    for index, (period, phase, offset) in enumerate(tasks):
        scheduler.add(str(index), times[index].append, period, phase=phase, offset_ns=offset)
    scheduler.run(start + 2_000)
    for (period, _, offset), seen in zip(tasks, times, strict=True):
        assert seen == list(range(start + offset, start + 2_000, period))


@given(
    st.lists(st.tuples(periods, st.integers(0, 3)), min_size=1, max_size=4),
    st.lists(st.integers(0, 900), min_size=1, max_size=30),
)
def test_phase_is_kept_and_no_count_is_lost_after_overruns(tasks, delays):
    clock = VirtualClock()
    scheduler = Scheduler(clock)
    dues: dict[str, list[int]] = {}
    waits = iter(delays)

    def work(name, period, now):
        dues.setdefault(name, []).append(now)
        clock.sleep_until(now + next(waits, 0))

    for index, (period, phase) in enumerate(tasks):
        name = str(index)
        scheduler.add(name, lambda now, n=name, p=period: work(n, p, now), period, phase=phase)
    scheduler.run(5_000)
    for (
        s,
        (next_due, *_),
    ) in zip(scheduler.statistics(), sorted(scheduler._heap, key=lambda entry: entry[2]), strict=True):
        assert next_due % s.period_ns == 0, "the grid moved"
        assert s.runs + s.overruns == next_due // s.period_ns, "a cycle was lost"
        assert s.runs == len(dues[s.name])
        assert next_due >= 5_000
        assert len(set(dues[s.name])) == s.runs, "ran twice at one time"


@given(
    st.lists(st.tuples(periods, st.integers(0, 3)), min_size=1, max_size=5),
    st.lists(st.integers(0, 200), max_size=20),
)
def test_the_order_is_the_same_every_time(tasks, delays):
    def trace():
        clock, seen, waits = VirtualClock(), [], iter(delays)

        def work(index, now):
            seen.append((now, index))
            clock.sleep_until(now + next(waits, 0))

        scheduler = Scheduler(clock)
        for index, (period, phase) in enumerate(tasks):
            scheduler.add(str(index), lambda now, i=index: work(i, now), period, phase=phase)
        scheduler.run(1_500)
        return seen

    first = trace()
    assert first == trace()
    for (now_a, a), (now_b, b) in pairwise(first):
        assert now_a <= now_b
        if now_a == now_b and not any(delays):  # Late tasks run in order of their due times instead.
            assert (tasks[a][1], a) < (tasks[b][1], b)


@given(st.lists(st.integers(0, 3_000), max_size=8))
def test_cutting_a_run_into_pieces_changes_nothing(cuts):
    def times(ends):
        scheduler, seen = Scheduler(VirtualClock()), []
        scheduler.add("a", lambda now: seen.append(("a", now)), 7, phase=1)
        scheduler.add("b", lambda now: seen.append(("b", now)), 11, phase=0)
        for end in ends:
            scheduler.run(end)
        return seen

    assert times([*sorted(cuts), 3_000]) == times([3_000])


@given(st.lists(st.integers(0, 10**12), min_size=1, max_size=300), st.floats(0, 1))
def test_quantiles_are_within_two_percent(values, q):
    histogram = LogHistogram()
    histogram.add(values)
    exact = float(np.quantile(values, q, method="inverted_cdf"))
    assert abs(histogram.quantile(q) - exact) <= 0.02 * exact
    assert histogram.count == len(values)
    assert histogram.total == sum(values)
    assert histogram.maximum == max(values)


@given(st.lists(st.integers(0, 10**9), max_size=100), st.integers(1, 7))
def test_batches_add_up(values, size):
    whole, pieces = LogHistogram(), LogHistogram()
    whole.add(values)
    for start in range(0, len(values), size):
        pieces.add(values[start : start + size])
    assert [whole.quantile(q / 10) for q in range(11)] == [pieces.quantile(q / 10) for q in range(11)]
    assert whole.mean == pieces.mean


def test_an_empty_histogram_is_zero():
    assert LogHistogram().quantile(0.5) == LogHistogram().mean == 0


def test_values_beyond_the_range_go_to_the_last_bin():
    histogram = LogHistogram()
    histogram.add([2**70, -5])
    assert histogram.count == 2
    assert histogram.quantile(1.0) > 2**58
