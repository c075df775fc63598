"""The cache bounded by bytes: what it keeps, what it forgets, and what counts."""

import threading
from collections import OrderedDict, deque
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_mocks import byte_cache
from lsds_mocks.byte_cache import ENTRY_BYTES, ByteCache, held_bytes, kept

SIZE = 10_000
#: Bytes that an entry of `array` counts.
EACH = SIZE + ENTRY_BYTES


def array(size=SIZE):
    return np.zeros(size, np.uint8)


def fail():
    raise AssertionError("made although it is kept")


@dataclass(frozen=True)
class Pair:
    one: object
    other: object


class Slotted:
    __slots__ = ("filled", "never")

    def __init__(self, filled):
        self.filled = filled


class Grows:
    """Works out its parts when they are first asked for."""

    def __init__(self):
        self.parts = []


def test_what_is_kept_is_the_same_object():
    cache = ByteCache(3 * EACH)
    first = cache.get("a", array)
    assert cache.get("a", fail) is first


def test_none_is_a_value():
    cache = ByteCache(3 * EACH)
    assert cache.get("a", lambda: None) is None
    assert cache.get("a", fail) is None


def test_the_one_used_longest_ago_goes_first():
    cache = ByteCache(3 * EACH)
    for key in "abc":
        cache.get(key, array)
    cache.get("a", fail)
    cache.get("d", array)
    assert [key for key in "abcd" if key in cache] == ["a", "c", "d"]


def test_what_is_larger_than_the_budget_is_returned_and_drives_nothing_out():
    cache = ByteCache(3 * EACH)
    cache.get("a", array)
    assert cache.get("large", lambda: array(4 * EACH)).size == 4 * EACH
    assert "large" not in cache
    assert "a" in cache


def test_an_error_is_raised_and_nothing_kept():
    cache = ByteCache(3 * EACH)
    with pytest.raises(AssertionError):
        cache.get("a", fail)
    assert len(cache) == 0


def test_what_entries_share_counts_once():
    cache, shared = ByteCache(2 * EACH), array()
    for key in range(5):
        cache.get(key, lambda: Pair(shared, None))
    assert len(cache) == 5
    assert cache.held_bytes() == SIZE + 5 * ENTRY_BYTES


def test_what_a_value_comes_to_hold_counts():
    cache = ByteCache(4 * EACH)
    grows = cache.get("grows", Grows)
    cache.get("a", array)
    grows.parts.extend(array() for _ in range(5))
    cache.get("b", array)
    assert "grows" not in cache
    assert "a" in cache


def test_values_without_arrays_are_forgotten_too():
    cache = ByteCache(10 * ENTRY_BYTES)
    for key in range(100):
        cache.get(key, lambda: 1.0)
    assert len(cache) == 10


def test_keys_count():
    cache = ByteCache(3 * EACH)
    for key in range(5):
        cache.get(bytes([key]) * SIZE, lambda: 1.0)
    assert len(cache) == 3


def test_forgotten_values_are_let_go():
    cache = ByteCache(EACH)
    parts = [Pair(array(), None)]
    released = threading.Event()

    class Last:
        def __del__(self):
            released.set()

    cache.get("a", lambda: Pair(parts, Last()))
    assert not released.is_set()
    cache.get("b", array)
    assert released.is_set()


@pytest.mark.parametrize(
    ("value", "size"),
    [
        (array(), SIZE),
        # A view keeps all of what it looks into.
        (array()[:10], SIZE),
        (np.frombuffer(bytes(SIZE), np.uint8), SIZE),
        (bytes(SIZE), SIZE),
        ((array(), [array(), {"a": array()}]), 3 * SIZE),
        (deque([array()]), SIZE),
        (OrderedDict(a=array()), SIZE),
        (Pair(array(), Pair(array(), 1.0)), 2 * SIZE),
        (Slotted(array()), SIZE),
        (Slotted(Slotted("text")), 0),
        (np.float32(1.0), 0),
        (array, 0),
        (np, 0),
    ],
)
def test_bytes_of(value, size):
    assert held_bytes(value) == size


def test_an_array_that_is_found_twice_counts_once_and_circles_end():
    one = array()
    circle = [one, one[5:], Pair(one, one)]
    circle.append(circle)
    assert held_bytes(circle) == SIZE


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 40_000)), max_size=60), st.integers(0, 100_000))
def test_the_budget_holds_and_the_newest_are_kept(asked, budget):
    cache, sizes, order = ByteCache(budget), {}, []
    for key, size in asked:
        value = cache.get(key, lambda size=size: array(size))
        size = value.size
        if key in order or size + ENTRY_BYTES <= budget:
            sizes[key] = size
            order = [*(k for k in order if k != key), key]
        while sum(sizes[k] + ENTRY_BYTES for k in order) > budget:
            order.pop(0)
        assert [k for k in range(10) if k in cache] == sorted(order)
        assert cache.held_bytes() == sum(sizes[k] + ENTRY_BYTES for k in order) <= budget


def test_threads_that_ask_together_get_the_same_object_and_the_budget_holds():
    cache = ByteCache(6 * EACH)
    gate, got = threading.Barrier(8), [[] for _ in range(8)]

    def ask(own):
        gate.wait()
        own.extend(cache.get(0, array) for _ in range(3))
        gate.wait()
        for turn in range(300):
            key = turn * (1 + id(own) % 3) % 9
            assert cache.get(key, partial(np.full, SIZE, key, np.uint8))[0] == key

    threads = [threading.Thread(target=ask, args=(own,)) for own in got]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {id(value) for own in got for value in own} == {id(got[0][0])}
    assert all(len(own) == 3 for own in got)
    assert cache.held_bytes() <= 6 * EACH


def test_functions_share_a_budget_and_not_their_values(monkeypatch):
    monkeypatch.setattr(byte_cache, "SHARED", ByteCache(3 * EACH))

    @kept
    def zeros(size, dtype="u1"):
        return np.zeros(size, dtype)

    @kept
    def ones(size):
        return np.ones(size, np.uint8)

    first = zeros(SIZE)
    assert zeros(SIZE) is first
    assert zeros.__name__ == "zeros"
    assert ones(SIZE)[0] == 1
    assert zeros(SIZE // 2, dtype="u2").dtype == np.uint16
    ones(SIZE)
    zeros(SIZE // 2, dtype="u2")
    ones(SIZE - 1)
    assert zeros(SIZE) is not first
    assert np.array_equal(zeros(SIZE), first)
