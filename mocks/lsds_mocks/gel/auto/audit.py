"""An audit in progress, and the points at which it compares two grids."""

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
"""Points at which errors are evaluated: 9 x 7, 2 mm apart."""


class Audit(NamedTuple):
    """State of the active grid when the audit began: legs of its path, its displacements (M, 2) and its travel.

    If the audited grid is to become the active one, `answers` is the reason and `legs` the number of legs it retraces.
    """

    until: int
    dots_m: NDArray[np.float64]
    sent_m: float
    answers: str = ""
    legs: int = sys.maxsize


def rms_m(difference_m: NDArray[np.float64]) -> float:
    """Return the RMS (m) of differences (M, 2)."""
    return float(np.sqrt((difference_m**2).sum(axis=1).mean()))
