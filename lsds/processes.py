"""Work spread over processes: each its own item, none harmed by another's crash, all gone when their parent is."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from multiprocessing import get_context, parent_process
from typing import TypeVar

DIED = "its process died (a library's crash, or out of memory)"
Item = TypeVar("Item")
Result = TypeVar("Result")


def spread(work: Callable[[Item], Result], items: Sequence[Item], jobs: int) -> Iterator[tuple[Item, Result | None]]:
    """Yield each item with what `work` makes of it, as they are done; None where its process died.

    `work` has to be picklable where `jobs` > 1, and returns no None of its own. What it raises is raised here, after
    those under way have ended; so it is where the iteration is broken off, by Ctrl-C for one.
    """
    if jobs <= 1 or len(items) <= 1:
        yield from ((item, work(item)) for item in items)
        return
    unfinished: list[Item] = []
    with _pool(min(jobs, len(items))) as pool:
        pending: dict[Future[Result], Item] = {pool.submit(partial(_guarded, work), item): item for item in items}
        try:
            for done in as_completed(pending):
                item = pending.pop(done)
                try:
                    yield item, done.result()
                except BrokenProcessPool:
                    unfinished.append(item)
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise
    # One of these took its process down, and the others' work with it: now each has a process to itself.
    for item in unfinished:
        with _pool(1) as pool:
            try:
                yield item, pool.submit(partial(_guarded, work), item).result()
            except BrokenProcessPool:
                yield item, None


def _pool(jobs: int) -> ProcessPoolExecutor:
    # Spawned, not forked: a fork in the middle of another thread's work inherits its locks.
    return ProcessPoolExecutor(jobs, get_context("spawn"), initializer=_quiet)


def _quiet() -> None:
    """One thread a process, and Ctrl-C is the parent's to answer."""
    import signal

    import cv2

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    cv2.setNumThreads(1)


def _guarded(work: Callable[[Item], Result], item: Item) -> Result:
    parent = parent_process()
    if parent is not None and not parent.is_alive():
        # Killed without a word: whoever goes on would do so beside the next campaign.
        os._exit(1)
    return work(item)
