"""One thread for the small matrix products of the per-frame path."""

from __future__ import annotations

import os


def one_thread() -> None:
    """Keep BLAS to one thread, unless the environment says otherwise. Has to be called before numpy is imported.

    A frame's products take microseconds; waking a second thread for them costs more than they do, and on a busy
    machine the frame waits for that thread to be scheduled.
    """
    for variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
        os.environ.setdefault(variable, "1")
