from __future__ import annotations

import threading

import pytest

from lsds.runtime.observers import Observers


def test_inline_observers_see_everything_in_order():
    seen = []
    with Observers(threaded=False, queue=1) as observers:
        observers.add("a", lambda item: seen.append(("a", item)), close=lambda: seen.append("a closed"))
        observers.add("b", lambda item: seen.append(("b", item)))
        observers.publish(1)
        observers.publish(2)
    assert seen == [("a", 1), ("b", 1), ("a", 2), ("b", 2), "a closed"]
    assert [(s.name, s.delivered, s.dropped) for s in observers.statistics()] == [("a", 2, 0), ("b", 2, 0)]


@pytest.mark.parametrize("threaded", [False, True])
def test_an_observer_that_raises_is_removed_and_the_others_go_on(threaded):
    seen = []

    def bad(item):
        raise ValueError("no disk")

    observers = Observers(threaded=threaded)
    observers.add("bad", bad)
    observers.add("good", seen.append)
    for item in range(3):
        observers.publish(item)
    observers.close()
    assert seen == [0, 1, 2]
    bad_statistics, good = observers.statistics()
    assert bad_statistics.failure == "ValueError: no disk"
    assert (bad_statistics.delivered, bad_statistics.dropped) == (0, 3)
    assert (good.delivered, good.dropped, good.failure) == (3, 0, "")


def test_a_slow_observer_loses_the_oldest_and_the_loop_does_not_wait():
    seen, started, go = [], threading.Event(), threading.Event()

    def slow(item):
        started.set()
        go.wait(5)
        seen.append(item)

    observers = Observers(threaded=True, queue=3)
    observers.add("slow", slow)
    observers.publish(0)
    assert started.wait(5)
    for item in range(1, 11):
        observers.publish(item)
    go.set()
    observers.close()
    assert seen == [0, 8, 9, 10]
    (s,) = observers.statistics()
    assert (s.delivered, s.dropped) == (4, 7)


def test_one_that_hangs_is_left_behind():
    release = threading.Event()
    observers = Observers(threaded=True, queue=10)
    observers.add("stuck", lambda item: release.wait(10))
    for item in range(3):
        observers.publish(item)
    observers.close(timeout_s=0.05)
    (s,) = observers.statistics()
    assert "did not finish" in s.failure
    assert s.dropped >= 2
    release.set()


def test_close_is_called_once_and_its_error_is_kept():
    closes = []

    def close():
        closes.append(1)
        raise OSError("disk full")

    observers = Observers(threaded=False)
    observers.add("a", print, close=close)
    observers.close()
    observers.close()
    observers.publish("after close")
    assert closes == [1]
    assert observers.statistics()[0].failure == "closing: OSError: disk full"


def test_a_name_is_taken_once():
    observers = Observers(threaded=False)
    observers.add("a", print)
    with pytest.raises(ValueError, match="already"):
        observers.add("a", print)


def test_an_item_that_does_not_wake_comes_with_the_next_one():
    seen, all_seen = [], threading.Event()

    def observe(item):
        seen.append(item)
        if item == "answer":
            all_seen.set()

    with Observers(threaded=True) as observers:
        observers.add("all", observe)
        observers.publish("frame", wake=False)
        observers.publish("answer")
        assert all_seen.wait(5)
    assert seen == ["frame", "answer"]


def test_an_item_that_does_not_wake_is_not_forgotten():
    all_seen = threading.Event()
    with Observers(threaded=True) as observers:
        observers.add("all", lambda item: all_seen.set())
        observers.publish("frame", wake=False)
        assert all_seen.wait(5)
