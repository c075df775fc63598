"""Parallel work in processes: a crash affects only its own item, and workers end with their parent.

A process that is started here searches the current folder for modules only if this process does: a file `struct.py`
that happens to lie there would replace Python's own.
"""

from __future__ import annotations

import gc
import os
import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from itertools import count
from multiprocessing import parent_process
from multiprocessing.context import SpawnContext, SpawnProcess
from threading import RLock
from typing import Any, Self, TypeVar

from lsds.errors import DataError

DIED = "its process died (a library's crash, or out of memory)"
Item = TypeVar("Item")
Result = TypeVar("Result")

_SAFE_PATH = "PYTHONSAFEPATH"
"""Python's variable that leaves the current folder out of the module search path."""


def module_command(module: str, *arguments: str) -> list[str]:
    """Return the command that runs a module with this Python, without the current folder in its search path."""
    return [sys.executable, "-P", "-m", module, *arguments]


def isolated_environment(extra: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return this process's environment for a child whose own children, too, ignore the current folder."""
    return {**os.environ, _SAFE_PATH: "1", **(extra or {})}


def read_lines(stream: Iterable[str], take: Callable[[str | None], object]) -> None:
    """Hand each line of a process's output to `take`, and None at its end, or when the stream is closed meanwhile."""
    try:
        for line in stream:
            take(line)
    except ValueError:
        pass
    finally:
        take(None)


def spread(work: Callable[[Item], Result], items: Sequence[Item], jobs: int) -> Iterator[tuple[Item, Result | None]]:
    """Yield each item with the result of `work` as it is done, from processes for these items only; see `Workers`."""
    with Workers(jobs) as workers:
        yield from workers.spread(work, items)


class Workers:
    """Up to `jobs` processes, started when there is work, and kept until the end of the `with` statement.

    A process takes seconds to load libraries, compiled functions and tables, so work that comes in many parts should
    keep its processes.
    """

    def __init__(self, jobs: int) -> None:
        self._jobs = jobs
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def spread(self, work: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[tuple[Item, Result | None]]:
        """Yield each item with the result of `work` as it is done; the result is None if its process died.

        With several jobs even a single item runs in another process, so that its crash does not end this one.
        `work` must then be picklable. It must not return None. An exception of `work` is raised here after the items in
        progress have ended; the same holds when the iteration is interrupted, for example by Ctrl-C. Raises DataError
        if no process can be started.
        """
        if self._jobs <= 1 or not items:
            yield from ((item, _tidily(work, item)) for item in items)
            return
        waiting, suspects = deque(items), list[Item]()
        while waiting:
            yield from self._together(work, waiting, suspects)
            # One of the items in progress crashed the pool. Repeat each of them in its own process to find it.
            for item in suspects:
                with _pool(1) as pool:
                    try:
                        yield item, pool.submit(work, item).result()
                    except BrokenProcessPool:
                        yield item, None
            suspects.clear()

    def _together(
        self, work: Callable[[Item], Result], waiting: deque[Item], suspects: list[Item]
    ) -> Iterator[tuple[Item, Result]]:
        """Yield items with their results until all are done or a process dies; `suspects` holds the items in
        progress."""
        pending: dict[Future[Result], Item] = {}
        pool = self._pool = self._pool or _pool(self._jobs)

        def hand_over() -> None:
            # Submit no more items than there are processes, because a submitted item cannot be withdrawn.
            while waiting and len(pending) < self._jobs:
                pending[pool.submit(_tidily, work, waiting[0])] = waiting[0]
                waiting.popleft()

        try:
            hand_over()
            while pending:
                ready, _ = wait(pending, return_when=FIRST_COMPLETED)
                done = [future for future in ready if future.exception() is None]
                results = [(pending.pop(future), future.result()) for future in done]
                broken: BrokenProcessPool | None = None
                if len(done) == len(ready):
                    # Work goes on while the caller handles these results, which may take a while.
                    try:
                        hand_over()
                    except BrokenProcessPool as error:
                        broken = error
                yield from results
                if broken is not None:
                    raise broken
                for future in ready:
                    future.result()
        except BrokenProcessPool:
            suspects += pending.values()
            self._end()
        except BaseException:
            self._end()
            raise

    def _end(self) -> None:
        """End the processes when the items in progress are done."""
        pool, self._pool = self._pool, None
        if pool is not None:
            pool.shutdown(wait=True, cancel_futures=True)


COLLECT_EVERY = 25
"""Number of items after which a process collects garbage; chosen: it takes 0.1 s, as much as 4 ms an item."""
_collected = count(1)


def _tidily(work: Callable[[Item], Result], item: Item) -> Result:
    """Return the result of `work`; collect garbage from time to time.

    Runs suspend full collections. A run that ended with an error leaves a megabyte that refers to itself.
    """
    result = work(item)
    if next(_collected) % COLLECT_EVERY == 0:
        gc.collect()
    return result


def _pool(jobs: int) -> ProcessPoolExecutor:
    # Spawn instead of fork: a forked process inherits locks held by other threads.
    with _isolation():
        # The queues of the pool start a process, too: multiprocessing's resource tracker.
        pool = ProcessPoolExecutor(jobs, _IsolatedContext(), initializer=_quiet)
    try:
        pool.submit(os.getpid).result()
    except BrokenProcessPool:
        raise DataError(
            "no worker process can be started (a script needs its main part below 'if __name__ == "
            '"__main__":\', or one job only)'
        ) from None
    return pool


class _IsolatedProcess(SpawnProcess):
    @staticmethod
    def _Popen(process_obj: Any) -> Any:
        # Spawning runs `python -c`, which searches the current folder first unless the environment forbids it.
        with _isolation():
            return SpawnProcess._Popen(process_obj)


class _IsolatedContext(SpawnContext):
    Process = _IsolatedProcess


_ISOLATING = RLock()


@contextmanager
def _isolation() -> Iterator[None]:
    """Set the variable in this process's environment, which the child inherits; one thread at a time."""
    with _ISOLATING:
        before = os.environ.get(_SAFE_PATH)
        os.environ[_SAFE_PATH] = "1"
        try:
            yield
        finally:
            if before is None:
                os.environ.pop(_SAFE_PATH, None)
            else:
                os.environ[_SAFE_PATH] = before


def _quiet() -> None:
    """Initialise a worker: one thread, Ctrl-C handled by the parent, exit when the parent dies."""
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
