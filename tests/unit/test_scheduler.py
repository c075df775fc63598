from __future__ import annotations

import threading
from itertools import pairwise

import pytest

from lsds.clock import VirtualClock, WallClock
from lsds.runtime.scheduler import Phase, Scheduler

MS = 1_000_000


def test_runs_on_the_grid_up_to_but_not_at_the_end():
    clock, times = VirtualClock(7), []
    scheduler = Scheduler(clock)
    scheduler.add("a", times.append, 10, phase=Phase.READ, offset_ns=3)
    assert scheduler.run(40) is True
    assert times == [10, 20, 30]
    assert clock.now() == 40
    scheduler.run(41)
    assert times[-1] == 40


def test_equal_times_run_in_order_of_phase_then_of_adding():
    seen = []
    scheduler = Scheduler(VirtualClock())
    for name, phase in [("observe", Phase.OBSERVE), ("read 1", Phase.READ), ("track", Phase.TRACK), ("read 2", 0)]:
        scheduler.add(name, lambda now, name=name: seen.append(name), 10, phase=phase)
    scheduler.run(20)
    assert seen == ["read 1", "read 2", "track", "observe"] * 2


def test_missed_cycles_are_skipped_and_counted_and_the_phase_is_kept():
    clock, times = VirtualClock(), []

    def slow(now):
        times.append(now)
        if now == 20:
            clock.sleep_until(55)

    scheduler = Scheduler(clock)
    scheduler.add("slow", slow, 10, phase=0)
    scheduler.run(100)
    assert times == [0, 10, 20, 60, 70, 80, 90]
    (statistics,) = scheduler.statistics()
    assert (statistics.runs, statistics.overruns) == (7, 3)
    assert statistics.max_lateness_ns == 0


def test_a_late_start_is_measured():
    clock = VirtualClock()
    scheduler = Scheduler(clock)
    scheduler.add("first", lambda now: clock.sleep_until(now + 4), 10, phase=0)
    scheduler.add("second", lambda now: None, 10, phase=1)
    scheduler.run(30)
    assert [s.max_lateness_ns for s in scheduler.statistics()] == [0, 4]


def test_no_task_ever_runs_twice_at_one_time():
    clock, times = VirtualClock(), []
    scheduler = Scheduler(clock)
    scheduler.add("hog", lambda now: clock.sleep_until(now + 50), 100, phase=0)
    scheduler.add("quick", times.append, 10, phase=1)
    scheduler.run(200)
    assert len(set(times)) == len(times)
    assert times[0] == 50
    assert times[1] == 60


def test_an_exception_carries_the_name_of_the_task_and_is_counted():
    def broken(now):
        if now == 20:
            raise ValueError("no")

    scheduler = Scheduler(VirtualClock())
    scheduler.add("broken", broken, 10, phase=0)
    with pytest.raises(ValueError, match="no") as caught:
        scheduler.run(100)
    assert caught.value.__notes__ == ["raised by task 'broken', due at 20 ns"]
    assert scheduler.statistics()[0].runs == 3
    scheduler.run(50)
    assert scheduler.statistics()[0].runs == 5


def test_stop_from_within_ends_before_the_next_task():
    seen = []
    scheduler = Scheduler(VirtualClock())
    scheduler.add("a", lambda now: (seen.append("a"), scheduler.stop()), 10, phase=0)
    scheduler.add("b", lambda now: seen.append("b"), 10, phase=1)
    assert scheduler.run(100) is False
    assert seen == ["a"]
    assert scheduler.run(1) is True
    assert seen == ["a", "b"]


def test_a_stop_that_comes_before_the_run_is_not_lost():
    scheduler = Scheduler(VirtualClock())
    scheduler.add("a", lambda now: None, 10, phase=0)
    scheduler.stop()
    assert scheduler.run(100) is False
    assert scheduler.statistics()[0].runs == 0


def test_stop_from_another_thread_under_the_wall_clock():
    clock = WallClock()
    scheduler = Scheduler(clock)
    scheduler.add("a", lambda now: None, MS, phase=0)
    timer = threading.Timer(0.03, scheduler.stop)
    timer.start()
    assert scheduler.run(clock.now() + 5_000 * MS) is False
    timer.join()
    assert scheduler.statistics()[0].runs >= 5


def test_the_wall_clock_is_kept_without_drift():
    clock, times = WallClock(), []
    scheduler = Scheduler(clock)
    scheduler.add("a", times.append, 5 * MS, phase=0)
    start = clock.now()
    scheduler.run(start + 100 * MS)
    ended = clock.now()
    (s,) = scheduler.statistics()
    # On a busy machine the last run may end late: what has come due by then counts, too.
    assert 20 <= s.runs + s.overruns <= (ended - start) // (5 * MS) + 1
    assert all(b > a for a, b in pairwise(times))


@pytest.mark.parametrize(("period", "offset"), [(0, 0), (-1, 0), (10, -1)])
def test_nonsense_is_refused(period, offset):
    with pytest.raises(ValueError, match="task 'a'"):
        Scheduler(VirtualClock()).add("a", lambda now: None, period, phase=0, offset_ns=offset)


def test_a_name_is_taken_once_and_only_between_runs():
    scheduler = Scheduler(VirtualClock())
    scheduler.add("a", lambda now: scheduler.add("b", print, 1, phase=0), 10, phase=0)
    with pytest.raises(ValueError, match="already"):
        scheduler.add("a", print, 10, phase=0)
    with pytest.raises(RuntimeError, match="while the scheduler runs"):
        scheduler.run(5)


def test_running_within_a_run_is_refused():
    scheduler = Scheduler(VirtualClock())
    scheduler.add("a", lambda now: scheduler.run(100), 10, phase=0)
    with pytest.raises(RuntimeError, match="already running"):
        scheduler.run(5)


def test_a_task_added_between_runs_joins_the_common_grid():
    scheduler, times = Scheduler(VirtualClock()), []
    scheduler.add("a", lambda now: None, 10, phase=0)
    scheduler.run(25)
    scheduler.add("b", times.append, 10, phase=0, offset_ns=1)
    scheduler.run(60)
    assert times == [31, 41, 51]


def test_an_empty_scheduler_only_lets_time_pass():
    clock = VirtualClock()
    assert Scheduler(clock).run(100) is True
    assert clock.now() == 100


def test_statistics_keep_their_size_and_their_counts_over_many_batches():
    scheduler = Scheduler(VirtualClock())
    scheduler.add("a", lambda now: None, 1, phase=0)
    scheduler.run(3_000)
    (s,) = scheduler.statistics()
    assert s.runs == 3_000
    assert 0 < s.p50_ns <= s.p99_ns <= s.max_ns
    assert len(scheduler._tasks[0].samples) == 0
