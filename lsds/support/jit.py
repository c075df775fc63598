"""The compiler of inner loops: numba, with its results kept on the machine."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit

#: Sums may be reordered, so that they run on several numbers at once. NaN and infinity keep their meaning. numba does
#: not notice a change: delete its caches (`*.nbi` in `__pycache__`) after one.
_FREEDOMS = {"reassoc", "contract", "arcp", "nsz"}


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function of arrays and numbers. A division by zero gives infinity or NaN, as in NumPy."""
    options: dict[str, Any] = {"fastmath": _FREEDOMS, "error_model": "numpy", "nogil": True}
    made: Callable[..., Any]
    try:
        made = njit(cache=True, **options)(function)
    except RuntimeError:
        # No folder for the cache can be written: compile in each process.
        made = njit(**options)(function)
    return made
