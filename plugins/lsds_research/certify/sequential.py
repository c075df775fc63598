"""The probability of a failure from runs that are spent where the answer is least certain.

The first quarter of the budget is drawn uniformly. A random forest fitted on its outcomes sorts the space by predicted
risk into strata (Dalenius and Hodges 1959); each further batch is drawn where it reduces the variance of the sum over
the strata most (Neyman 1934, with predicted instead of known variances). Half-way the forest is fitted again. Runs
that chose the strata do not count in them, so each stage is an estimate without bias; the stages are averaged by their
numbers of runs. The interval is the exact one (Clopper and Pearson 1934) of as many runs drawn evenly as would have the
variance of that estimate (Korn and Graubard 1998). In the variance each stratum has one more run, at its predicted
rate, because a stratum in which nothing failed is not certain to have no failures.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lsds.support.extras import require
from lsds_research.search.split import exact_bounds

Points = list[NDArray[np.float64]]
Floats = NDArray[np.float64]

RUNS_PER_BATCH = 16
"""Runs of a batch, whatever the number of processes, so that results do not depend on it."""
STAGES = (0.25, 0.6, 1.0)
"""Shares of the budget at which the stages end."""
LEAST_POOL = 5_000
"""Minimum number of uniform points that represent the space; the size of a stratum is its share of them."""
POOL_PER_RUN = 4
"""Number of such points for each run of the whole budget, so that a stratum is seldom drained; chosen."""
STRATA = 6
"""Number of strata into which a forest divides the space; chosen."""
LEAST_STRATUM_RUNS = 4
"""Least number of runs of a stratum."""
TREES = 40
"""Number of trees of the forest that predicts the risk; chosen."""
DOUBT = 0.3
"""Weight of the mean failure rate in the predicted rate of a stratum; chosen."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A probability with a two-sided 95 % interval.

    `weights` (runs) are the shares of the space that the runs stand for, in their order; they sum to 1. `auc` is the
    area under the curve of the forest's prediction for runs that it was not fitted on, NaN if none or all failed.
    """

    estimate: float
    least: float
    most: float
    failed: int
    runs: int
    weights: Floats
    auc: float


@dataclass
class _Stage:
    """Runs of one stage: stratum and margin of each; sizes and predicted failure rates of the strata.

    The sizes are shares of `pool` points, 0 for a single stratum, whose size is known.
    """

    sizes: Floats
    rates: Floats
    strata: list[int] = field(default_factory=list)
    margins: list[float] = field(default_factory=list)
    pool: int = 0

    @property
    def counts(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Runs and failures of each stratum."""
        own, failed = np.array(self.strata, int), np.array(self.margins) < 0
        return np.bincount(own, minlength=len(self.sizes)), np.bincount(own[failed], minlength=len(self.sizes))


Describe = Callable[[Points | Floats], Floats]
"""Returns what a forest gets of points: rows (n, columns)."""
StratumOf = Callable[[Floats], NDArray[np.intp]]
"""Returns the stratum of each point."""


def sequential(
    dimensions: int, used: Callable[[int], float], seed: int, describe: Describe = np.array
) -> Generator[Points, Sequence[float], Estimate]:
    """Yield batches of points of the unit cube; send back their margins, below 0 for a failure; return the estimate.

    The margins may be those of the first points of a batch only.

    `used` returns the share of the budget that is used after a number of runs; `describe` may add columns to the points
    for the forest. Raises MissingExtra without scikit-learn.
    """
    require("sklearn", extra="search", purpose="a certificate")
    rng = np.random.default_rng(seed)
    points: list[Floats] = []
    margins: list[float] = []
    stages: list[_Stage] = []
    for begins, ends in pairwise((0.0, *STAGES)):
        whole = round(len(points) / begins) if begins else 0
        size = max(LEAST_POOL, POOL_PER_RUN * whole)
        stage, pool, stratum, stratum_of = _begun(dimensions, points, margins, rng, seed, describe, size)
        # A point that is drawn again shows nothing new, so each is drawn once, in a random order.
        order = rng.permutation(size)
        left = _sorted_into(stage, pool[order], stratum[order])
        while not stage.margins or used(len(points)) < ends:
            own = _allotted(stage, rng)
            chosen = []
            for k in own:
                while not left[k]:
                    pool = rng.random(pool.shape)
                    left = _sorted_into(stage, pool, stratum_of(pool))
                chosen.append(left[k].pop())
            answered = yield chosen
            stage.strata += own[: len(answered)]
            stage.margins += list(answered)
            points += chosen[: len(answered)]
            margins += list(answered)
        stages.append(stage)
        if used(len(points)) >= STAGES[-1]:
            break
    return _estimate(stages, points, margins, seed, describe)


def _sorted_into(stage: _Stage, pool: Floats, stratum: NDArray[np.intp]) -> list[Points]:
    """Return the points of each stratum."""
    return [list(pool[stratum == k]) for k in range(len(stage.sizes))]


def plain(
    dimensions: int, used: Callable[[int], float], seed: int, describe: Describe = np.array
) -> Generator[Points, Sequence[float], Estimate]:
    """Yield uniform points until the budget is used; return the estimate by counting."""
    rng = np.random.default_rng(seed)
    points: list[Floats] = []
    stage = _Stage(np.ones(1), np.full(1, 0.5))
    while not points or used(len(points)) < 1:
        chosen = list(rng.random((RUNS_PER_BATCH, dimensions)))
        answered = yield chosen
        stage.margins += list(answered)
        points += chosen[: len(answered)]
    stage.strata = [0] * len(points)
    return _estimate([stage], points, stage.margins, seed, describe)


def _begun(
    dimensions: int,
    points: Points,
    margins: Sequence[float],
    rng: np.random.Generator,
    seed: int,
    describe: Describe,
    size: int,
) -> tuple[_Stage, Floats, NDArray[np.intp], StratumOf]:
    """Return a new stage, its pool of points, the stratum of each, and that of others; one where nothing is known."""
    pool = rng.random((size, dimensions))
    failed = np.array(margins) < 0
    if not failed.any() or failed.all():
        return _Stage(np.ones(1), np.full(1, 0.5)), pool, np.zeros(size, int), lambda some: np.zeros(len(some), int)
    forest = fitted_forest(describe(points), failed, seed)

    def risk_of(some: Floats) -> Floats:
        return np.asarray(forest.predict_proba(describe(some))[:, 1])

    risk = risk_of(pool)
    # Equal parts of the sum of square roots of the variances: small strata where the outcome is uncertain.
    order = np.sort(risk)
    spread = np.cumsum(np.sqrt(np.maximum(order * (1 - order), 1e-3)))
    parts = spread[-1] * np.arange(1, STRATA) / STRATA
    cuts = order[np.searchsorted(spread, parts)]

    def stratum_of(some: Floats) -> NDArray[np.intp]:
        return np.searchsorted(cuts, risk_of(some), side="right")

    stratum = np.searchsorted(cuts, risk, side="right")
    counts = np.bincount(stratum, minlength=STRATA)
    predicted = np.bincount(stratum, weights=risk, minlength=STRATA) / np.maximum(counts, 1)
    # A forest on few runs is too sure of itself.
    rates = (1 - DOUBT) * predicted + DOUBT * failed.mean()
    return _Stage(counts / size, rates, pool=size), pool, stratum, stratum_of


def fitted_forest(rows: Floats, failed: NDArray[np.bool_], seed: int) -> Any:
    """Return a random forest that predicts failures from described points (n, columns), fitted to their outcomes."""
    from sklearn.ensemble import RandomForestClassifier

    forest = RandomForestClassifier(TREES, min_samples_leaf=2, oob_score=True, random_state=seed, n_jobs=1)
    return forest.fit(rows, failed)


def _allotted(stage: _Stage, rng: np.random.Generator) -> list[int]:
    """Return the strata of the next batch: one run after the other to where it reduces the predicted variance most.

    The outcomes of this stage do not decide, because a stratum that is left after few runs without a failure would be
    underestimated.
    """
    runs = stage.counts[0].astype(float)
    variance = stage.sizes**2 * stage.rates * (1 - stage.rates)
    usable = np.flatnonzero(stage.sizes > 0)
    own: list[int] = []
    for _ in range(RUNS_PER_BATCH):
        short = usable[runs[usable] < LEAST_STRATUM_RUNS]
        if len(short):
            k = int(short[np.argmin(runs[short])])
        else:
            k = int(usable[np.argmax(variance[usable] / (runs[usable] * (runs[usable] + 1)))])
        own.append(k)
        runs[k] += 1
    rng.shuffle(own)
    return own


def _estimate(
    stages: Sequence[_Stage],
    points: Points,
    margins: Sequence[float],
    seed: int,
    describe: Describe = np.array,
) -> Estimate:
    whole = len(points)
    estimate, variance = 0.0, 0.0
    weights: list[float] = []
    for stage in stages:
        share = len(stage.margins) / whole
        runs, failed = stage.counts
        known = runs > 0
        sizes = stage.sizes[known] / stage.sizes[known].sum()
        own, own_failed = runs[known], failed[known]
        estimate += share * float(np.sum(sizes * own_failed / own))
        # One more run at the predicted rate, so that a stratum without a failure is not certain to have none.
        rates = (own_failed + stage.rates[known]) / (own + 1)
        variance += share**2 * float(np.sum(sizes**2 * rates * (1 - rates) / np.maximum(own - 1, 1)))
        if stage.pool:
            middle = float(np.sum(sizes * rates))
            variance += share**2 * middle * (1 - middle) / stage.pool
        share_of = dict(zip(np.flatnonzero(known), share * sizes / own, strict=True))
        weights += [share_of[k] for k in stage.strata]
    count = int(np.sum(np.array(margins) < 0))
    if len(stages) == len(stages[0].sizes) == 1 or count in (0, whole):
        least, most = exact_bounds(count, whole, 0.025)
    else:
        # As many runs drawn evenly would have this variance.
        even = estimate * (1 - estimate) / variance
        least, most = exact_bounds(estimate * even, even, 0.025)
    return Estimate(
        estimate, least, most, count, whole, np.array(weights), _auc(describe(points), margins, weights, seed)
    )


def _auc(rows: Floats, margins: Sequence[float], weights: Sequence[float], seed: int) -> float:
    """Return how well a forest ranks runs that it was not fitted on: failures above the others (Mann and Whitney).

    Each run counts by its share of the space, because more of them were drawn where failures are expected.
    """
    from sklearn.metrics import roc_auc_score

    failed = np.array(margins) < 0
    if min(failed.sum(), (~failed).sum()) < 2:
        return float("nan")
    votes = fitted_forest(rows, failed, seed).oob_decision_function_[:, 1]
    voted = np.isfinite(votes)
    if min(failed[voted].sum(), (~failed[voted]).sum()) < 1:
        return float("nan")
    return float(roc_auc_score(failed[voted], votes[voted], sample_weight=np.asarray(weights)[voted]))
