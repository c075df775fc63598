"""Work spread over processes: each its own item, none harmed by another's crash, all gone when their parent is."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, parent_process
from typing import TypeVar

from lsds.errors import DataError

DIED = "its process died (a library's crash, or out of memory)"
Item = TypeVar("Item")
Result = TypeVar("Result")


def spread(work: Callable[[Item], Result], items: Sequence[Item], jobs: int) -> Iterator[tuple[Item, Result | None]]:
    """Yield each item with what `work` makes of it, as they are done; None where its process died.

    `work` has to be picklable where `jobs` > 1, and returns no None of its own. What it raises is raised here, after
    the one to each process that is under way has ended; so it is where the iteration is broken off, by Ctrl-C for one.
    Raises DataError where no process can be started.
    """
    if jobs <= 1 or len(items) <= 1:
        yield from ((item, work(item)) for item in items)
        return
    waiting, suspects = deque(items), list[Item]()
    while waiting:
        yield from _together(work, waiting, min(jobs, len(items)), suspects)
        # One of those under way took its process down, and the others with it: now each has a process to itself.
        for item in suspects:
            with _pool(1) as pool:
                try:
                    yield item, pool.submit(work, item).result()
                except BrokenProcessPool:
                    yield item, None
        suspects.clear()


def _together(
    work: Callable[[Item], Result], waiting: deque[Item], jobs: int, suspects: list[Item]
) -> Iterator[tuple[Item, Result]]:
    """Yield items with their results until there are none left, or until a process dies: `suspects` were under way."""
    pending: dict[Future[Result], Item] = {}
    with _pool(jobs) as pool:

        def hand_over() -> None:
            # No more at a time than there are processes: what has been handed over cannot be taken back.
            while waiting and len(pending) < jobs:
                pending[pool.submit(work, waiting[0])] = waiting[0]
                waiting.popleft()

        try:
            hand_over()
            while pending:
                ready, _ = wait(pending, return_when=FIRST_COMPLETED)
                for done in ready:
                    result = done.result()
                    yield pending.pop(done), result
                hand_over()
        except BrokenProcessPool:
            suspects += pending.values()
        except BaseException:
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def _pool(jobs: int) -> ProcessPoolExecutor:
    # Spawned, not forked: a fork in the middle of another thread's work inherits its locks.
    pool = ProcessPoolExecutor(jobs, get_context("spawn"), initializer=_quiet)
    try:
        pool.submit(os.getpid).result()
    except BrokenProcessPool:
        raise DataError(
            "no process can be started beside this one (a script needs its main part below 'if __name__ == "
            '"__main__":\', or one job only)'
        ) from None
    return pool


def _quiet() -> None:
    """One thread a process; Ctrl-C is the parent's to answer; killed without a word, it takes its children along."""
    import signal
    from threading import Thread

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_follow, daemon=True).start()
    import cv2

    cv2.setNumThreads(1)


def _follow() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
