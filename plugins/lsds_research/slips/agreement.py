"""Agreement of two labellers on the same recordings."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lsds_research.slips.labels import Labels, State, states
from lsds_research.slips.score import EARLY, LATE, LEAST_CONFIDENCE, scored_intervals

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lsds_research.slips.labels import Interval


@dataclass(frozen=True, slots=True)
class Agreement:
    """`frames` that both labelled with confidence (neither unsure nor touch), the share `same` of equal labels (slip or
    not), and Cohen's `kappa` of these; `intervals` of slip of either labeller, and the number that `both` labelled."""

    videos: int
    frames: int
    same: float
    kappa: float
    intervals: int
    both: int


def agreement(first: Labels, second: Labels) -> Agreement:
    """Return the agreement on the videos that both have labelled."""
    shared = sorted(set(first) & set(second))
    pairs = np.zeros((2, 2), int)
    named = both = 0
    for video in shared:
        one, other = first[video], second[video]
        count = max(one[-1].last, other[-1].last) + 1
        (state, sure), (state_2, sure_2) = states(one, count), states(other, count)
        clear = (sure >= LEAST_CONFIDENCE) & (sure_2 >= LEAST_CONFIDENCE)
        clear &= np.isin(state, _CLEAR) & np.isin(state_2, _CLEAR)
        np.add.at(pairs, ((state[clear] == State.SLIP).astype(int), (state_2[clear] == State.SLIP).astype(int)), 1)
        matched = _matched(one, other)
        both += matched
        named += len(scored_intervals(one)) + len(scored_intervals(other)) - _matched(other, one)
    total = int(pairs.sum())
    same = float(np.trace(pairs)) / total if total else math.nan
    chance = float(pairs.sum(axis=0) @ pairs.sum(axis=1)) / total**2 if total else math.nan
    kappa = (same - chance) / (1 - chance) if total and chance < 1 else math.nan
    return Agreement(len(shared), total, same, kappa, named, both)


_CLEAR = (State.FREE, State.STICK, State.SLIP)


def _matched(one: Sequence[Interval], other: Sequence[Interval]) -> int:
    return sum(_meets(own, scored_intervals(other)) for own in scored_intervals(one))


def _meets(own: Interval, others: Sequence[Interval]) -> bool:
    """Return whether one of the others overlaps an interval, within the uncertainty of an onset."""
    return any(own.first - LATE <= each.last + EARLY and each.first - EARLY <= own.last + LATE for each in others)
