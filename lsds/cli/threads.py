"""Defaults for parallel work: one BLAS thread in the per-frame path, one process per core for batches."""

from __future__ import annotations

import os

from lsds.support.blas import VARIABLES

MOST_PROCESSES = 256
"""Maximum number of processes; chosen."""


def processes() -> int:
    """Return the default number of processes of a command."""
    return min(MOST_PROCESSES, os.cpu_count() or 1)


def one_thread() -> None:
    """Limit BLAS to one thread unless the environment sets another number, for the reason in `lsds.support.blas`.

    Call it before numpy is imported.
    """
    for variable in VARIABLES:
        os.environ.setdefault(variable, "1")
