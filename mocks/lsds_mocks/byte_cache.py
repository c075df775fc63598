"""A cache that forgets by bytes: what was used longest ago goes first when the arrays kept get too many.

A cache bounded by a count keeps as much memory as its values happen to hold. Here all caches of a process share one
budget. A value in use lives on by its user's own reference; the cache only forgets it, and makes it anew when asked.
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
"""Of all values that `kept` keeps in a process. The tables of one gel hold 100 to 150 MB for the default grids, each
size of contact adds some megabytes, and the stamps of one dot are 9 MB: runs on one gel, of a few objects in turns,
recompute nothing."""
ENTRY_BYTES = 1024
"""Size of an entry besides its arrays. Without it, values without arrays would never be dropped."""
_ATOMS = (int, float, complex, str, type(None), type, FunctionType, BuiltinFunctionType, MethodType, ModuleType)


class ByteCache:
    """Values by key, from the one used longest ago to the newest; together with their keys they hold at most `budget`
    bytes. Any thread may use it.

    Arrays that several entries hold count once. Every entry is measured again whenever one is added, so what a value
    has come to hold meanwhile counts too.
    """

    def __init__(self, budget: int) -> None:
        self._budget = budget
        self._values: OrderedDict[Hashable, Any] = OrderedDict()
        self._lock = Lock()

    def get(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return the value of a key, and make it if it is missing. A value larger than the budget is not kept.

        Threads that ask at the same time may each make one; all of them get the one that was there first.
        """
        with self._lock:
            if key in self._values:
                self._values.move_to_end(key)
                value: T = self._values[key]
                return value
        made = make()
        # Not under the lock: who else asks need not wait for it.
        fits = held_bytes(made) + ENTRY_BYTES <= self._budget
        with self._lock:
            value = self._values.get(key, made)
            if fits:
                self._values[key] = value
                self._values.move_to_end(key)
                forgotten = self._forget()
        if fits:
            # Free the memory after the lock is released, so that no other thread waits for it.
            forgotten.clear()
        return value

    def held_bytes(self) -> int:
        """Return how many bytes all entries hold now."""
        with self._lock:
            return held_bytes(*self._values.keys(), *self._values.values()) + ENTRY_BYTES * len(self._values)

    def clear(self) -> None:
        """Forget everything."""
        with self._lock:
            self._values.clear()

    def __len__(self) -> int:
        return len(self._values)

    def __contains__(self, key: Hashable) -> bool:
        return key in self._values

    def _forget(self) -> list[Any]:
        """Drop the oldest entries, so that the newest fit; return what they held."""
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
            # A view keeps all of the array alive that it looks into.
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
    """Return what an object holds, listed at once: another thread may add to it."""
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
