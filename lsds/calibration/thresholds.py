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

    Of the moving frames it allows so many per 100, rounded down; of the still ones rounded up, as a thousand frames at
    rest, which one glimpse may spoil, are half a minute. A frame whose score is NaN, where the detector abstains,
    raises no alarm.
    """
    # Before rounding to whole frames: 5 % of 40 frames is 2, whatever floats make of it.
    most_moving = math.floor(round(len(moving) * budget.moving / 100, 9))
    most_still = math.ceil(round(len(still) * budget.still / 100, 9))
    return max(_exceeded(moving, most_moving), _exceeded(still, most_still))


def _exceeded(scores: Floats, most: int) -> float:
    """Return the lowest score that at most so many exceed."""
    ordered = np.sort(np.nan_to_num(scores, nan=-math.inf))
    return float(ordered[-1 - most]) if most < len(ordered) else -math.inf


def exceeds(scores: Floats, least: float) -> Mask:
    """Return where a score exceeds the threshold."""
    return np.asarray(np.nan_to_num(scores, nan=-math.inf) > least)
