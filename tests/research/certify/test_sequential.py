"""The estimate of a certificate: its interval covers known probabilities, runs go where the answer is uncertain."""

from __future__ import annotations

import numpy as np
import pytest
from lsds_research.certify.sequential import RUNS_PER_BATCH, Estimate, _estimate, _Stage, plain, sequential
from research.certify.answering import answered, budget

pytest.importorskip("sklearn", reason="scikit-learn is not installed: pip install '.[search]'")
DIMENSIONS = 12


def planted(seed, share):
    """Return a margin that is below 0 in about a share of the space: a slope over a few keys, and noise."""
    rng = np.random.default_rng(seed)
    keys = rng.choice(DIMENSIONS, rng.integers(2, 5), replace=False)
    slopes = rng.uniform(0.5, 1.5, len(keys)) * rng.choice([-1, 1], len(keys))
    mix = np.arange(1, DIMENSIONS + 1)

    def height(points):
        return points[..., keys] @ slopes + 0.15 * np.sin(1e4 * (points @ mix))

    heights = height(rng.random((100_000, DIMENSIONS)))
    limit = np.quantile(heights, 1 - share)
    return (lambda point: float(limit - height(point))), float((heights > limit).mean())


@pytest.mark.parametrize("draw", [plain, sequential])
def test_weights_sum_to_one_and_one_seed_gives_one_answer(draw):
    margin, _ = planted(1, 0.2)
    first, points = answered(draw(DIMENSIONS, budget(96), 5), margin)
    again, same = answered(draw(DIMENSIONS, budget(96), 5), margin)
    assert isinstance(first, Estimate)
    assert first.runs == len(points) == 96
    assert first.weights.sum() == pytest.approx(1.0)
    assert (points == same).all()
    assert (first.estimate, first.least, first.most) == (again.estimate, again.least, again.most)
    assert 0 <= first.least <= first.estimate <= first.most <= 1


@pytest.mark.parametrize(("margin", "ends"), [(1.0, "least"), (-1.0, "most")])
def test_where_none_or_all_fail_the_interval_ends_at_zero_or_one(margin, ends):
    estimate, _ = answered(sequential(DIMENSIONS, budget(64), 1), lambda _: margin)
    assert estimate.estimate == getattr(estimate, ends) == (0.0 if margin > 0 else 1.0)
    assert 0 < estimate.most - estimate.least < 0.11
    assert np.isnan(estimate.auc)


def test_runs_go_where_failures_are():
    shares = []
    for seed in range(1, 5):
        margin, _ = planted(seed, 0.05)
        estimate, points = answered(sequential(DIMENSIONS, budget(320), seed + 1), margin)
        failed = np.array([margin(point) < 0 for point in points])
        shares.append(failed[-RUNS_PER_BATCH * 8 :].mean())
        assert estimate.auc > 0.7
        assert len({tuple(point) for point in points}) == len(points), "a point that is drawn again shows nothing new"
    assert np.mean(shares) > 1.25 * 0.05


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.01, 0.05])
def test_the_interval_of_a_quick_certificate_contains_the_probability(share):
    covered = []
    for seed in range(30):
        margin, true = planted(seed, share)
        estimate, _ = answered(sequential(DIMENSIONS, budget(48), seed), margin)
        covered.append(estimate.least <= true <= estimate.most)
    assert np.mean(covered) >= 0.85


def test_strata_without_failures_do_not_raise_the_lower_end():
    """One failure in 96 runs over six strata; the probability may be nearly zero."""
    stage = _Stage(np.full(6, 1 / 6), np.full(6, 0.02), [k % 6 for k in range(96)], [-1.0] + [1.0] * 95)
    estimate = _estimate([stage], [np.zeros(2)] * 96, stage.margins, 0)
    assert estimate.least < 0.002
    assert 0.03 < estimate.most < 0.1


def test_the_priors_of_many_strata_do_not_raise_the_lower_end():
    """One failure in each of 18 strata of 8 runs: 18 of 144 as a plain count, whose interval begins at 7.6 %."""
    sizes, rates = np.full(18, 1 / 18), np.full(18, 0.1)
    stage = _Stage(sizes, rates, [k % 18 for k in range(144)], [-1.0] * 18 + [1.0] * 126)
    estimate = _estimate([stage], [np.zeros(2)] * 144, stage.margins, 0)
    assert estimate.least < 0.076


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.01, 0.05, 0.2])
def test_95_percent_of_the_intervals_contain_the_probability(share):
    covered, narrower = [], []
    for seed in range(24):
        margin, true = planted(seed, share)
        estimate, _ = answered(sequential(DIMENSIONS, budget(240), seed), margin)
        counted, _ = answered(plain(DIMENSIONS, budget(240), seed), margin)
        covered.append(estimate.least <= true <= estimate.most)
        narrower.append((estimate.most - estimate.least) / (counted.most - counted.least))
    assert np.mean(covered) >= 0.9
    if share >= 0.05:
        assert np.median(narrower) < 1.0


def test_a_large_first_stage_draws_each_point_once():
    draw = sequential(2, lambda runs: runs / 24_000, 0)
    batch, seen = next(draw), []
    while len(seen) < 5900:
        seen += [tuple(point) for point in batch]
        batch = draw.send([1.0] * len(batch))
    assert len(set(seen)) == len(seen)


def test_a_stratum_of_which_all_points_are_drawn_gets_new_ones():
    """A tenth of a small pool is one stratum of high risk, and half of the runs go there."""
    seen = set()
    draw = sequential(1, lambda runs: runs / 30_000, 3)
    batch = next(draw)
    for _ in range(1_700):
        seen.update(point.tobytes() for point in batch)
        batch = draw.send([-1.0 if point[0] > 0.95 and point[0] * 1e3 % 1 < 0.5 else 1.0 for point in batch])
    assert len(seen) == 1_700 * RUNS_PER_BATCH
