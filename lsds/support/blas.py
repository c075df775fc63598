"""One BLAS thread while a cell runs in this process.

The matrix products of a frame, and of a gel, take microseconds. Waking a second thread costs more than that, and on a
busy machine each product waits until that thread is scheduled. Commands say so before NumPy is imported
(`lsds.cli.threads`); a program that calls `lsds.run` has imported it already.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager

VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
"""Environment variables that set the number of BLAS threads."""
_limits = threading.Lock()
"""Held by the block that limits the threads, which only the thread that has limited them can give back."""


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Limit BLAS to one thread inside the block, in the whole process, unless the environment sets a number.

    It applies to libraries that are loaded. Of blocks that overlap, in several threads of a process, only the first
    limits the threads, until it ends.
    """
    if any(variable in os.environ for variable in VARIABLES) or not _limits.acquire(blocking=False):
        yield
        return
    try:
        from threadpoolctl import threadpool_limits

        with threadpool_limits(limits=1, user_api="blas"):
            yield
    finally:
        _limits.release()
