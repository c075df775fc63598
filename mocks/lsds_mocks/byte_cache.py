"""A cache with a limit in bytes, which drops the least recently used values first.

The memory of a cache with a limited number of entries depends on the size of its values. Here all caches of a process
share one budget in bytes. A dropped value stays alive while its user references it; the cache makes it again on the
next request.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Callable, Hashable, Iterable
from functools import wraps
from threading import Lock
from types import BuiltinFunctionType, FunctionType, MethodType, ModuleType
from typing import Any, ParamSpec, TypeVar

import numpy as np

P = ParamSpec("P")
T = TypeVar("T")

BUDGET_BYTES = 192 * 2**20
"""Limit of all values that `kept` caches in a process. The tables of one gel take 100 to 150 MB for the default grids,
each size of contact adds some megabytes, and the stamps of one marker take 9 MB, so alternating runs of a few objects
on one gel recompute nothing."""
ENTRY_BYTES = 1024
"""Size of an entry without its arrays. Without it, values without arrays would never be dropped."""
_ATOMS = (int, float, complex, str, type(None), type, FunctionType, BuiltinFunctionType, MethodType, ModuleType)


class ByteCache:
    """Values by key, in order of last use; values and keys together hold at most `budget` bytes. It is thread-safe.

    An array in several entries counts once. Adding an entry measures all entries again, so growth of a cached value
    counts, too.
    """

    def __init__(self, budget: int) -> None:
        self._budget = budget
        self._values: OrderedDict[Hashable, Any] = OrderedDict()
        self._lock = Lock()

    def get(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return the value of a key, and make it if it is missing. A value larger than the budget is not cached.

        Concurrent threads may each make a value; all of them get the one that was stored first.
        """
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
                value: T = self._values[key]
                return value
        made = make()
        # Measure without the lock, so that other threads need not wait.
        fits = held_bytes(made) + ENTRY_BYTES <= self._budget
        with self._lock:
            value = self._values.get(key, made)
            if not fits:
                return value
            self._values[key] = value
            self._values.move_to_end(key)
            forgotten = self._forget()
        # Free the memory after the lock is released, so that no other thread waits for it.
        forgotten.clear()
        return value

    def held_bytes(self) -> int:
        """Return how many bytes all entries hold now."""
        with self._lock:
            return held_bytes(*self._values.keys(), *self._values.values()) + ENTRY_BYTES * len(self._values)

    def clear(self) -> None:
        """Drop all entries."""
        with self._lock:
            self._values.clear()

    def __len__(self) -> int:
        return len(self._values)

    def __contains__(self, key: Hashable) -> bool:
        return key in self._values

    def _forget(self) -> list[Any]:
        """Drop the oldest entries so that the newest fit; return the dropped entries."""
        seen: set[int] = set()
        total, fitting = 0, 0
        for key, value in reversed(self._values.items()):
            total += held_bytes(key, value, seen=seen) + ENTRY_BYTES
            if total > self._budget:
                break
            fitting += 1
        return [self._values.popitem(last=False) for _ in range(len(self._values) - fitting)]


def held_bytes(*values: object, seen: set[int] | None = None) -> int:
    """Return the bytes of all arrays and byte strings that values hold: in containers, attributes and slots, to any
    depth. Objects in `seen`, by identity, do not count; those found are added to it."""
    seen = set() if seen is None else seen
    total, waiting = 0, deque(values)
    while waiting:
        item = waiting.pop()
        if isinstance(item, _ATOMS):
            continue
        if isinstance(item, np.ndarray):
            # A view keeps its whole base array alive.
            while isinstance(item.base, np.ndarray):
                item = item.base
        if id(item) in seen:
            continue
        seen.add(id(item))
        if isinstance(item, np.ndarray):
            total += item.nbytes
        elif isinstance(item, bytes | bytearray):
            total += len(item)
        elif not isinstance(item, np.generic):
            waiting.extend(_parts(item))
    return total


def _parts(item: Any) -> Iterable[Any]:
    """Return a list of the objects that an object holds; a copy, because another thread may add to it."""
    if isinstance(item, dict):
        return [*item.keys(), *item.values()]
    if isinstance(item, tuple | list | set | frozenset | deque):
        return list(item)
    parts = list(getattr(item, "__dict__", {}).values())
    for kind in type(item).__mro__:
        names = getattr(kind, "__slots__", ())
        listed = (names,) if isinstance(names, str) else names
        parts.extend(getattr(item, name) for name in listed if name[:2] != "__" and hasattr(item, name))
    return parts


SHARED = ByteCache(BUDGET_BYTES)
"""Holds the values of all functions that are decorated with `kept`."""


def kept(function: Callable[P, T]) -> Callable[P, T]:
    """Return a function whose values are kept within the budget that all such functions share.

    The arguments must be hashable; the same value is returned as long as it is kept, so do not modify it.
    """

    @wraps(function)
    def remembered(*args: P.args, **kwargs: P.kwargs) -> T:
        key = (function, args, tuple(sorted(kwargs.items())))
        return SHARED.get(key, lambda: function(*args, **kwargs))

    return remembered
