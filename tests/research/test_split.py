"""Probabilities of rare failures: splitting agrees with what is known, and with plain counting."""

from __future__ import annotations

import numpy as np
import pytest
from lsds_research.search.split import MOST_LEVELS, counted, split
from scipy.stats import norm


def estimated(margin, dimensions=4, runs=200, seed=0):
    """Return the probability, and how many scenarios it took."""
    batches, count = split(dimensions, runs, seed), 0
    batch = next(batches)
    while True:
        count += len(batch)
        try:
            batch = batches.send([margin(point) for point in batch])
        except StopIteration as end:
            return end.value, count


def beyond(limit):
    """Fails where the sum of the coordinates, made normal, is beyond a limit of standard deviations."""
    return lambda point: limit - float(norm.ppf(point).sum()) / np.sqrt(len(point))


@pytest.mark.parametrize("limit", [1.0, 3.09, 4.0])
def test_a_known_probability_lies_within_its_bounds(limit):
    true = norm.sf(limit)
    found = [estimated(beyond(limit), seed=seed)[0] for seed in range(20)]
    within = sum(one.least <= true <= one.most for one in found)
    assert within >= 15
    assert np.exp(np.mean(np.log([one.estimate for one in found]))) == pytest.approx(true, rel=0.5)


def two_sided(limit):
    """Fails where the first coordinate, made normal, is beyond a limit on either side."""
    return lambda point: limit - abs(float(norm.ppf(point[0])))


@pytest.mark.parametrize("runs", [50, 100])
@pytest.mark.parametrize(
    ("margin", "true"),
    [(beyond(3.09), norm.sf(3.09)), (two_sided(3.29), 2 * norm.sf(3.29))],
    ids=["one side", "two sides"],
)
def test_few_scenarios_give_bounds_that_are_wide_enough(margin, true, runs):
    found = [estimated(margin, seed=seed, runs=runs)[0] for seed in range(40)]
    # Each bound is wrong with 5 %: more than 5 of 40 has a probability of 1.4 %.
    assert sum(one.most < true for one in found) <= 5
    assert sum(one.least > true for one in found) <= 5


def test_a_rare_failure_takes_far_fewer_scenarios_than_counting():
    _, count = estimated(beyond(4.0))
    assert count < 1200 < 1 / norm.sf(4.0) / 20


def test_it_agrees_with_counting_where_that_can_be_done():
    def margin(point):
        return 0.9 - point[0] * point[1]

    rng = np.random.default_rng(0)
    plain = counted(int(sum(margin(point) < 0 for point in rng.random((20_000, 2)))), 20_000)
    found, _ = estimated(margin, dimensions=2, runs=400)
    assert found.least <= plain.most
    assert plain.least <= found.most


def test_counting_gives_the_bounds_of_clopper_and_pearson():
    none = counted(0, 2995)
    assert (none.estimate, none.least) == (0.0, 0.0)
    assert none.most == pytest.approx(1e-3, rel=1e-3)
    assert counted(10, 10).most == 1.0


def test_what_never_fails_has_a_bound_and_no_estimate():
    never, count = estimated(lambda point: 1.0 + float(point[0]), runs=100)
    assert (never.estimate, never.failed) == (0.0, 0)
    assert len(never.levels) == MOST_LEVELS
    assert never.most < 1e-4
    # If margins do not show a direction of descent, the result is that of counting.
    flat, count = estimated(lambda point: 1.0, runs=100)
    assert count == 100
    assert flat.most == pytest.approx(counted(0, 100).most)
