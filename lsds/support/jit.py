"""The compiler of inner loops: numba, with its results kept on the machine."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit

#: Sums may be reordered, so that they run on several numbers at once. NaN and infinity keep their meaning.
_FREEDOMS = {"reassoc", "contract", "arcp", "nsz"}


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function of arrays and numbers. A division by zero gives infinity or NaN, as in NumPy."""
    made: Callable[..., Any] = njit(cache=True, fastmath=_FREEDOMS, error_model="numpy", nogil=True)(function)
    return made
