"""One thread for the small matrix products of the per-frame path, and as many processes as there are cores."""

from __future__ import annotations

import os

MOST_PROCESSES = 256


def processes() -> int:
    """Return how many processes a command uses that is not told."""
    return min(MOST_PROCESSES, os.cpu_count() or 1)


def one_thread() -> None:
    """Keep BLAS to one thread, unless the environment says otherwise. Has to be called before numpy is imported.

    A frame's products take microseconds; waking a second thread for them costs more than they do, and on a busy
    machine the frame waits for that thread to be scheduled.
    """
    for variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
