"""Dangerous zones: ranges of few keys in which failures are frequent (PRIM, Friedman and Fisher 1999).

A box starts as the whole space. One side after the other is peeled off, always the one that raises the failure rate
inside most, until too few runs would be left. The sides that matter least are then put back. The next zone is looked
for in the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lsds_research.search.space import Axis, Value

PEEL = 0.1
"""Share of the runs in a box that one step takes off."""
LEAST_BOX_RUNS = 12
"""Least number of runs in a box."""
LEAST_FAILED = 4
"""Least number of failures in a zone."""
MOST_KEYS = 3
"""Greatest number of keys that a zone names."""
LOSES = 0.9
"""A side is put back if the failure rate stays above this share of the best."""
MOST_ZONES = 3
"""Maximum number of zones that a search returns; chosen."""
SHUFFLES = 19
"""Searches with shuffled outcomes: a zone that beats all of them is due to chance in 1 of 20 campaigns."""


@dataclass(frozen=True, slots=True)
class Zone:
    """A box of the unit cube: bounds (keys, 2), share of the space, and failure rate from `failed` of `runs`."""

    bounds: NDArray[np.float64]
    share: float
    rate: float
    failed: int
    runs: int

    def text(self, space: Sequence[Axis]) -> str:
        """Return the ranges in words, as config keys with values."""
        parts = []
        for axis, (low, high) in zip(space, self.bounds, strict=True):
            if low <= 0 and high >= 1:
                continue
            name = axis.key.rpartition(".")[2]
            if axis.choices:
                first, last = (
                    min(int(end * len(axis.choices)), len(axis.choices) - 1) for end in (low + 1e-9, high - 1e-9)
                )
                named = axis.choices[first : last + 1]
                if len(named) < len(axis.choices):
                    parts.append(f"{name} {' or '.join(map(str, named))}")
            elif low <= 0:
                parts.append(f"{name} below {_short(axis.value(high))}")
            elif high >= 1:
                parts.append(f"{name} above {_short(axis.value(low))}")
            else:
                parts.append(f"{name} {_short(axis.value(low))} to {_short(axis.value(high))}")
        return ", ".join(parts) or "everywhere"


def zones(
    points: NDArray[np.float64],
    failed: NDArray[np.bool_],
    weights: NDArray[np.float64],
    choices: Sequence[int] = (),
    most: int = MOST_ZONES,
) -> list[Zone]:
    """Return up to `most` zones, the most dangerous first; `weights` (runs) are the shares of the space.

    `choices` is the number of choices of each key, 0 for a range; a zone contains whole choices.

    A box with many failures is found in noise, too, because it is chosen among very many. A zone counts if its failure
    rate is above those that the same search finds with the outcomes shuffled.
    """
    among = np.asarray(choices or [0] * points.shape[1])
    stepped = among > 0
    # A choice is its middle: a side of a box that goes through it leaves it inside.
    places = np.where(stepped, (np.minimum(np.floor(points * among), among - 1) + 0.5) / np.maximum(among, 1), points)
    found = [_with_whole(zone, among) for zone in _zones(places, failed, weights, most)]
    if not found:
        return []
    rng = np.random.default_rng(0)
    shuffled = [_zones(places, rng.permutation(failed), weights, 1) for _ in range(SHUFFLES)]
    chance = max((zone.rate for one in shuffled for zone in one), default=0.0)
    return [zone for zone in found if zone.rate > chance]


def _with_whole(zone: Zone, choices: NDArray[np.int64]) -> Zone:
    """Return a zone whose bounds end where choices end."""
    bounds = zone.bounds.copy()
    for key in np.flatnonzero(choices):
        low, high = bounds[key] * choices[key]
        bounds[key] = np.floor(low) / choices[key], np.ceil(high) / choices[key]
    return replace(zone, bounds=bounds, share=float(np.prod(np.diff(bounds, axis=1))))


def _zones(
    points: NDArray[np.float64], failed: NDArray[np.bool_], weights: NDArray[np.float64], most: int
) -> list[Zone]:
    left = np.ones(len(points), bool)
    found: list[Zone] = []
    while len(found) < most:
        bounds = _box(points[left], failed[left], weights[left])
        if bounds is None:
            break
        inside = left & _within(points, bounds)
        count = int(failed[inside].sum())
        rate = _rate(failed[inside], weights[inside])
        if count < LEAST_FAILED or rate <= _rate(failed, weights):
            break
        share = float(np.prod(np.diff(bounds, axis=1)))
        found.append(Zone(bounds, share, rate, count, int(inside.sum())))
        left &= ~inside
    return sorted(found, key=lambda zone: -zone.rate)


def _box(
    points: NDArray[np.float64], failed: NDArray[np.bool_], weights: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Return the bounds of the box with the highest failure rate, None if too few failed."""
    if failed.sum() < LEAST_FAILED:
        return None
    bounds = np.tile([0.0, 1.0], (points.shape[1], 1))
    while (inside := _within(points, bounds)).sum() > LEAST_BOX_RUNS:
        better, best = None, _rate(failed[inside], weights[inside])
        own, bad, heavy = points[inside], failed[inside], weights[inside]
        for key in range(points.shape[1]):
            for side, quantile in ((0, PEEL), (1, 1 - PEEL)):
                edge = _edge(own[:, key], side, quantile)
                stays = own[:, key] >= edge if side == 0 else own[:, key] <= edge
                if LEAST_BOX_RUNS <= stays.sum() < len(own) and (rate := _rate(bad[stays], heavy[stays])) > best:
                    better, best = (key, side, edge), rate
        if better is None:
            break
        bounds[better[0], better[1]] = better[2]
    return _simplest(points, failed, weights, bounds)


def _edge(values: NDArray[np.float64], side: int, quantile: float) -> float:
    """Return where a side moves to: a quantile, or past the first choice if that is not less than all of a choice.

    It is always one of the values, so that a side never lies between two choices.
    """
    edge = float(np.quantile(values, quantile, method="lower" if side else "higher"))
    end = float(values.max() if side else values.min())
    if edge != end:
        return edge
    inner = values[values != end]
    return end if not len(inner) else float(inner.max() if side else inner.min())


def _simplest(
    points: NDArray[np.float64], failed: NDArray[np.bool_], weights: NDArray[np.float64], bounds: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return a box with fewer keys: those that cost least are put back, all but `MOST_KEYS` in any case."""

    def rate(box: NDArray[np.float64]) -> float:
        inside = _within(points, box)
        return _rate(failed[inside], weights[inside])

    best = rate(bounds)
    while len(used := [key for key in range(len(bounds)) if tuple(bounds[key]) != (0.0, 1.0)]) > 1:
        wider = []
        for key in used:
            box = bounds.copy()
            box[key] = 0.0, 1.0
            wider.append((rate(box), key))
        least, key = max(wider)
        if least < LOSES * best and len(used) <= MOST_KEYS:
            break
        bounds[key] = 0.0, 1.0
    return bounds


def _within(points: NDArray[np.float64], bounds: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.asarray(((points >= bounds[:, 0]) & (points <= bounds[:, 1])).all(axis=1))


def _rate(failed: NDArray[np.bool_], weights: NDArray[np.float64]) -> float:
    total = float(weights.sum())
    return float(weights[failed].sum()) / total if total > 0 else 0.0


def _short(value: Value) -> str:
    return f"{value:.3g}" if isinstance(value, float) else str(value)
