"""The labels of one recording during editing: a cursor, a mark, and states set between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from lsds_research.slips.labels import Interval, State

KEYS = {"f": State.FREE, "k": State.STICK, "s": State.SLIP, "t": State.TOUCH, "u": State.UNSURE}
"""Keys that set a state."""


class Marking:
    """States of `count` frames; unlabelled frames are unsure with confidence 0."""

    def __init__(self, count: int, intervals: Sequence[Interval] = (), labeller: str = "") -> None:
        self._count, self._labeller = count, labeller
        self._before: list[list[Interval]] = []
        self.intervals = _whole(list(intervals), count)
        self.cursor = 0
        self.mark: int | None = None

    def move(self, frames: int) -> None:
        """Move the cursor, at most to either end."""
        self.cursor = min(max(self.cursor + frames, 0), self._count - 1)

    @property
    def chosen(self) -> tuple[int, int]:
        """First and last frame between mark and cursor; the cursor's frame alone without a mark."""
        other = self.cursor if self.mark is None else self.mark
        return min(other, self.cursor), max(other, self.cursor)

    def set(self, state: State) -> None:
        """Set the state of the selected frames and remove the mark."""
        first, last = self.chosen
        self._before.append(self.intervals)
        own = Interval(first, last, state, labeller=self._labeller)
        kept = []
        for each in self.intervals:
            if each.first < first:
                kept.append(replace(each, last=min(each.last, first - 1)))
            if each.last > last:
                kept.append(replace(each, first=max(each.first, last + 1)))
        self.intervals = _joined(sorted([*kept, own], key=lambda each: each.first))
        self.mark = None

    def undo(self) -> None:
        """Undo the last change."""
        if self._before:
            self.intervals = self._before.pop()

    def at(self, number: int) -> Interval:
        """Return the interval of a frame."""
        return next(each for each in self.intervals if each.first <= number <= each.last)


def _whole(intervals: list[Interval], count: int) -> list[Interval]:
    """Return the intervals cut or filled to `count` frames."""
    kept = [replace(each, last=min(each.last, count - 1)) for each in intervals if each.first < count]
    begin = kept[-1].last + 1 if kept else 0
    return [*kept, Interval(begin, count - 1, State.UNSURE, confidence=0.0)] if begin < count else kept


def _joined(intervals: list[Interval]) -> list[Interval]:
    """Return the intervals with equal neighbours merged."""
    result: list[Interval] = []
    for each in intervals:
        if result and _alike(result[-1], each):
            result[-1] = replace(result[-1], last=each.last)
        else:
            result.append(each)
    return result


def _alike(one: Interval, other: Interval) -> bool:
    """Return whether two neighbours are equal. Intervals with a travel stay separate, because travels would add up."""
    travels = (own for each in (one, other) for own in (each.tx_px, each.ty_px, each.turn_deg))
    return all(map(math.isnan, travels)) and _key(one) == _key(other)


def _key(own: Interval) -> tuple[State, float, str, str]:
    return own.state, own.confidence, own.labeller, own.note
