"""Keeping Python's garbage collector out of the way of the loop."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def quiet_collector() -> Iterator[None]:
    """Leave everything that exists now out of collections until the end.

    A full collection walks over every object of every imported library, some ten milliseconds in the middle of a
    frame; frozen, only what the loop itself makes is looked at. What is garbage already waits until the end too:
    looking for it now would cost those ten milliseconds.
    """
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
