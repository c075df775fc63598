"""Memory of this process, for a limit on what programs keep."""

from __future__ import annotations

import ctypes
import gc
import os

LIMIT_BYTES = 64 << 20
"""Memory that programs may add to the mock (bytes)."""

CYCLES_PER_MEASUREMENT = 8
"""Cycles between two measurements."""


def resident_bytes() -> int:
    """Return the resident memory of this process; 0 if the system does not report it."""
    try:
        with open("/proc/self/statm", "rb") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, IndexError):
        return 0


def give_back() -> None:
    """Return free memory to the system, as far as possible."""
    gc.collect()
    try:
        ctypes.CDLL(None).malloc_trim(0)
    except (OSError, AttributeError):
        return


class MemoryWatch:
    """Detects that programs take too much memory, compared with the last time when none ran."""

    def __init__(self) -> None:
        self._before = resident_bytes()
        self._calls = 0
        self._idle = True

    def exceeded(self, busy: bool) -> bool:
        """Return whether the limit is exceeded; call it once per cycle. `busy` is whether programs run."""
        if not busy:
            self._idle = True
            return False
        if self._idle:
            self._idle, self._before, self._calls = False, resident_bytes(), 0
        self._calls += 1
        return self._calls % CYCLES_PER_MEASUREMENT == 0 and resident_bytes() - self._before > LIMIT_BYTES
