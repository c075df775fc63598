"""The lowest threshold at which a detector's false alarms stay within a budget."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Mask = NDArray[np.bool_]


LEAST_OBJECTS = 3
"""Minimum number of objects to predict the false alarms on another one."""
TIGHTER = (1.0, 0.8, 0.6, 0.45, 0.3, 0.2, 0.1)
"""Shares of the budget that are tried."""


@dataclass(frozen=True, slots=True)
class Budget:
    """False alarms allowed per 100 frames in which object and gel move together, and per 100 in which both rest."""

    moving: float = 5.0
    still: float = 0.1


def threshold(moving: Floats, still: Floats, budget: Budget) -> float:
    """Return the lowest score that no more frames exceed than the budget allows; -inf without any frame.

    The allowed number of moving frames is rounded down. That of still frames is rounded up: half a minute at rest is a
    thousand frames, and one disturbance would exceed the budget. A NaN score (an abstention) raises no alarm.
    """
    # Round off floating-point errors first: 5 % of 40 frames is exactly 2.
    most_moving = math.floor(round(len(moving) * budget.moving / 100, 9))
    most_still = math.ceil(round(len(still) * budget.still / 100, 9))
    return max(_exceeded(moving, most_moving), _exceeded(still, most_still))


def transferable(
    groups: Sequence[tuple[Floats, Floats]], budget: Budget, find: Callable[..., float] = threshold
) -> tuple[float, float, tuple[float, float]]:
    """Return a threshold that holds for other objects too, its share of the budget, and the false alarms left out.

    `groups` are the scores of the moving and the still frames of each object. Other objects exceed a fitted threshold
    more often (on real recordings twice as often). The threshold therefore uses a share of the budget: the largest of
    `TIGHTER` at which the objects, left out in turn, stay within the whole budget. With fewer than `LEAST_OBJECTS` the
    share is 1. The false alarms are those of the objects left out, per 100 moving and per 100 still frames, or NaN with
    one object.
    """
    everything = _joined(groups)
    left_out = _left_out(groups, budget, find)
    if len(groups) < LEAST_OBJECTS:
        return find(*everything, budget), 1.0, left_out
    share, part = 1.0, budget
    for share in TIGHTER:
        part = Budget(share * budget.moving, budget.still)
        left_out = _left_out(groups, part, find)
        if not left_out[0] > budget.moving:
            break
    return find(*everything, part), share, left_out


def _left_out(
    groups: Sequence[tuple[Floats, Floats]], budget: Budget, find: Callable[..., float]
) -> tuple[float, float]:
    if len(groups) < 2:
        return math.nan, math.nan
    called = []
    for at, own in enumerate(groups):
        least = find(*_joined([*groups[:at], *groups[at + 1 :]]), budget)
        called.append([exceeds(part, least) for part in own])
    moving, still = (np.concatenate(part) for part in zip(*called, strict=True))
    return _per_100(moving), _per_100(still)


def _per_100(alarms: Mask) -> float:
    return 100 * float(alarms.mean()) if len(alarms) else math.nan


def _joined(groups: Sequence[tuple[Floats, Floats]]) -> tuple[Floats, Floats]:
    moving, still = (np.concatenate([np.empty(0), *part]) for part in zip(*groups, strict=True))
    return moving, still


def _exceeded(scores: Floats, most: int) -> float:
    """Return the lowest score that at most `most` scores exceed."""
    ordered = np.sort(np.nan_to_num(scores, nan=-math.inf))
    return float(ordered[-1 - most]) if most < len(ordered) else -math.inf


def exceeds(scores: Floats, least: float) -> Mask:
    """Return the mask of the scores that exceed the threshold."""
    return np.asarray(np.nan_to_num(scores, nan=-math.inf) > least)
