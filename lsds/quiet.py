"""Suspend full garbage collections and OpenCV threads while an engine runs, and restore them afterwards."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

import cv2


@contextmanager
def quiet_process() -> Iterator[None]:
    """Suspend full garbage collections and OpenCV's threads until the end, then restore the previous settings.

    A full collection visits every object of every imported library, which takes some ten milliseconds in the middle of
    a frame; after freezing, only objects created by the loop are visited. Objects that the program has frozen itself
    stay frozen. Tactile images are small: waking OpenCV's threads costs several times what they save.
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
