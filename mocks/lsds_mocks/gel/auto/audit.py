"""An audit under way, and the dots at which two grids are compared."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def _dots() -> NDArray[np.float64]:
    x, y = np.meshgrid((np.arange(9) - 4) * 2e-3, (np.arange(7) - 3) * 2e-3)
    return np.asarray(np.stack([x.ravel(), y.ravel()], axis=1), np.float64)


DOTS_M = _dots()
"""Where errors are looked at: 9 x 7 dots, 2 mm apart."""


class Audit(NamedTuple):
    """How many legs the path had, how the answering grid's dots (M, 2) stood and how far it had gone when the audit was
    sent out; why the other grid is to answer, where that is settled, and over how many legs it comes."""

    until: int
    dots_m: NDArray[np.float64]
    sent_m: float
    answers: str = ""
    legs: int = sys.maxsize


def rms_m(difference_m: NDArray[np.float64]) -> float:
    """Return the root of the dots' mean square (M, 2)."""
    return float(np.sqrt((difference_m**2).sum(axis=1).mean()))
