"""The probability of a failure that is too rare to be counted, by multilevel splitting (subset simulation).

The first level has scenarios drawn uniformly from a space. Each next level starts from the worst tenth of the last:
random walks, limited to scenarios no better than the best of that tenth, fill it up. Levels end when a tenth of one
fails. The probability is a tenth to the power of the number of levels, times the failed share of the last level (Au and
Beck 2001, Probabilistic Engineering Mechanics 16; steps by conditional sampling, Papaioannou et al. 2015, ibid. 41).
"""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lsds.support.extras import require

Points = list[NDArray[np.float64]]

LEVEL_SHARE = 0.1
"""Share of the scenarios of a level from which the next level starts."""
MOST_SHARE = 0.5
"""Maximum share of a level at its limit; with a larger share the margins show no direction of descent."""
MOST_LEVELS = 6
"""Maximum number of levels; a rarer failure has a probability below one in a million."""
STEP_SHARE = 0.6
"""New share of a random step, of 1. A greater share is rejected more often, a smaller one moves less."""
CONFIDENCE = 0.95
"""Confidence of each bound."""
LEVELS_CORRELATE = 0.5
"""Correlation assumed between the shares of neighbouring levels, of which one descends from the other. Identified on
problems with known probabilities: with 0 a bound of 95 % misses in up to 14 %, with this in 5 to 6 % at most."""


@dataclass(frozen=True, slots=True)
class Probability:
    """A probability with bounds: it is at most `most` and at least `least` with 95 % confidence each.

    `levels` are the margins at which the levels began; `failed` of the last level's `runs` failed. Without a failure
    only the bound holds.
    """

    estimate: float
    least: float
    most: float
    levels: tuple[float, ...]
    failed: int
    runs: int


def counted(failed: int, runs: int) -> Probability:
    """Return the probability by plain counting, with bounds of 95 % each."""
    return Probability(failed / runs, *exact_bounds(failed, runs, 0.05), (), failed, runs)


def exact_bounds(failed: float, runs: float, outside: float) -> tuple[float, float]:
    """Return the bounds of a failure rate, each wrong with the probability `outside` (Clopper and Pearson 1934).

    The counts need not be whole. Raises MissingExtra without scipy.
    """
    require("scipy", extra="search", purpose="a probability")
    from scipy.stats import beta

    low = float(beta.ppf(outside, failed, runs - failed + 1)) if failed else 0.0
    high = float(beta.ppf(1 - outside, failed + 1, runs - failed)) if failed < runs else 1.0
    return low, high


def split(dimensions: int, runs: int, seed: int) -> Generator[Points, Sequence[float], Probability]:
    """Yield batches of points of the unit cube; send back their margins, below 0 for a failure; return the probability.

    `runs` is the number of points of a level. Raises MissingExtra without scipy.
    """
    require("scipy", extra="search", purpose="a probability")
    from scipy.special import ndtr

    rng = np.random.default_rng(seed)
    chains = max(2, round(LEVEL_SHARE * runs))
    steps = max(2, runs // chains)
    places = rng.standard_normal((chains * steps, dimensions))
    margins = np.array((yield [ndtr(place) for place in places]), float)
    ancestors = np.arange(len(places))
    levels: list[float] = []
    before, deviations = 1.0, list[float]()
    while len(levels) < MOST_LEVELS:
        limit = float(np.partition(margins, chains - 1)[chains - 1])
        # Margins are coarse: scenarios equal to the limit belong to the level.
        within = margins <= limit
        if limit < 0 or np.mean(within) > MOST_SHARE:
            break
        levels.append(limit)
        before *= float(np.mean(within))
        deviations.append(_deviation(within, ancestors))
        chosen = rng.permutation(np.flatnonzero(within))[:chains]
        now, margin = places[chosen], margins[chosen]
        walked, seen = [now], [margin]
        for _ in range(steps - 1):
            moved = math.sqrt(1 - STEP_SHARE**2) * now + STEP_SHARE * rng.standard_normal(now.shape)
            found = np.array((yield [ndtr(place) for place in moved]), float)
            taken = found <= limit
            now, margin = np.where(taken[:, None], moved, now), np.where(taken, found, margin)
            walked.append(now)
            seen.append(margin)
        places, margins = np.concatenate(walked), np.concatenate(seen)
        ancestors = np.tile(np.arange(chains), steps)
    return _probability(before, margins < 0, ancestors, deviations, levels)


def _deviation(happened: NDArray[np.bool_], ancestors: NDArray[np.intp]) -> float:
    """Return the coefficient of variation of a share whose samples correlate within each chain."""
    share = float(np.mean(happened))
    chains = [float(np.mean(happened[ancestors == own])) for own in np.unique(ancestors)]
    return math.sqrt(np.var(chains, ddof=1) / len(chains)) / share


def _spread(deviations: Sequence[float], chains: int) -> float:
    """Return the factor of a one-sided bound of a product of shares: lognormal, with Student's t for few chains."""
    from scipy.stats import t

    variance = sum(own**2 for own in deviations) + 2 * LEVELS_CORRELATE * sum(map(math.prod, pairwise(deviations)))
    return math.exp(float(t.ppf(CONFIDENCE, chains - 1)) * math.sqrt(math.log1p(variance)))


def _probability(
    before: float,
    failed: NDArray[np.bool_],
    ancestors: NDArray[np.intp],
    deviations: Sequence[float],
    levels: Sequence[float],
) -> Probability:
    count, runs = int(failed.sum()), len(failed)
    if not levels:
        return counted(count, runs)
    independent = len(np.unique(ancestors))
    if not count:
        # Count each chain as one independent scenario.
        spread = _spread(deviations, independent)
        return Probability(0.0, 0.0, min(1.0, before * spread * counted(0, independent).most), tuple(levels), 0, runs)
    share = count / runs
    spread = _spread([*deviations, _deviation(failed, ancestors)], independent)
    estimate = before * share
    return Probability(estimate, estimate / spread, min(1.0, estimate * spread), tuple(levels), count, runs)
