"""Keeping the interpreter and OpenCV out of the way of a running engine, and putting everything back afterwards."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

import cv2


@contextmanager
def quiet_process() -> Iterator[None]:
    """Keep full garbage collections and OpenCV's threads away until the end; then all is as it was before.

    A full collection walks over every object of every imported library, some ten milliseconds in the middle of a
    frame; frozen, only what the loop itself makes is looked at. Where the program has frozen objects of its own, they
    are left alone. Tactile images are too small to share: waking OpenCV's threads costs several times what they save.
    """
    threads = cv2.getNumThreads()
    freezes = gc.get_freeze_count() == 0
    cv2.setNumThreads(1)
    if freezes:
        gc.freeze()
    try:
        yield
    finally:
        if freezes:
            gc.unfreeze()
        cv2.setNumThreads(threads)
