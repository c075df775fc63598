"""Suspend full garbage collections and OpenCV threads while an engine runs, and restore them afterwards."""

from __future__ import annotations

import gc
import threading
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
    _enter()
    try:
        yield
    finally:
        _leave()


class _Before:
    """How the process was before the first of several engines began: what the last one puts back."""

    lock = threading.Lock()
    running = 0
    threads = 1
    froze = False


def _enter() -> None:
    with _Before.lock:
        _Before.running += 1
        if _Before.running == 1:
            _Before.threads, _Before.froze = cv2.getNumThreads(), gc.get_freeze_count() == 0
            cv2.setNumThreads(1)
            if _Before.froze:
                gc.freeze()


def _leave() -> None:
    with _Before.lock:
        _Before.running -= 1
        if _Before.running == 0:
            if _Before.froze:
                gc.unfreeze()
            cv2.setNumThreads(_Before.threads)
