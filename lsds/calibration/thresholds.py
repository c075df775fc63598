"""The lowest threshold at which a detector calls slip no more often than allowed, where nothing slips."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Budget:
    """False alarms allowed per 100 frames in which object and gel move together, and per 100 in which both rest."""

    moving: float = 5.0
    still: float = 0.1


def threshold(moving: Floats, still: Floats, budget: Budget) -> float:
    """Return the lowest score that no more frames exceed than the budget allows; -inf without any frame.

    Of n frames the budget allows so many per 100, rounded up: a thousand still frames may hold one alarm. A frame
    whose score is NaN, where the detector abstains, raises none.
    """
    return max(_exceeded(moving, budget.moving), _exceeded(still, budget.still))


def _exceeded(scores: Floats, per_100: float) -> float:
    if not len(scores):
        return -math.inf
    ordered = np.sort(np.nan_to_num(scores, nan=-math.inf))
    # Rounded, as 5 % of 40 frames is 2 and not 3, whatever floats make of it.
    allowed = math.ceil(round(len(ordered) * per_100 / 100, 9))
    return float(ordered[-1 - allowed]) if allowed < len(ordered) else -math.inf


def alarms(scores: Floats, least: float) -> Mask:
    """Return where a score exceeds the threshold."""
    return np.asarray(np.nan_to_num(scores, nan=-math.inf) > least)
