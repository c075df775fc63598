"""Dangerous zones: a planted box is found, with its keys and ranges in words."""

from __future__ import annotations

import numpy as np
import pytest
from lsds_research.certify.zones import zones
from lsds_research.search.space import Axis

SPACE = (
    Axis("cell.simulated.mass_kg", 0.0, 1.0),
    Axis("cell.simulated.shape", choices=("box", "sphere", "edge", "cylinder")),
    Axis("task.lift_speed_m_s", 0.02, 0.08),
    *(Axis(f"cell.simulated.other_{k}", 0.0, 1.0) for k in range(5)),
)


def drawn(seed=0, runs=600):
    rng = np.random.default_rng(seed)
    return rng, rng.random((runs, len(SPACE))), np.full(runs, 1 / runs)


def test_a_planted_box_is_named_by_its_keys():
    rng, points, weights = drawn()
    inside = (points[:, 0] > 0.7) & (points[:, 1] >= 0.25) & (points[:, 1] < 0.5)
    failed = inside | (rng.random(len(points)) < 0.01)
    first, *_ = zones(points, failed, weights)
    assert first.rate > 0.8
    text = first.text(SPACE)
    assert "shape sphere" in text
    assert "mass_kg above 0.6" in text or "mass_kg above 0.7" in text
    assert "other_" not in text


def test_a_zone_contains_whole_choices():
    """Three of four choices are inside: the share of the space is three quarters, and the text names these three."""
    _, points, weights = drawn(2)
    failed = (points[:, 1] >= 0.25) & (points[:, 2] > 0.5)
    first, *_ = zones(points, failed, weights, [len(axis.choices) for axis in SPACE])
    assert tuple(first.bounds[1]) == (0.25, 1.0)
    assert "shape sphere or edge or cylinder" in first.text(SPACE)
    assert first.rate > 0.95


@pytest.mark.parametrize("count", [2, 4, 10, 22])
def test_the_runs_of_a_zone_are_those_of_the_choices_that_it_names(count):
    space = (Axis("cell.simulated.object", choices=tuple(f"o{k}" for k in range(count))), SPACE[0])
    for seed in range(60):
        rng = np.random.default_rng(seed)
        runs = int(rng.integers(60, 240))
        points, weights = rng.random((runs, 2)), np.full(runs, 1 / runs)
        # Some choices are seldom drawn, so that a tenth of the runs ends near them.
        points[:, 0] **= rng.uniform(0.5, 2)
        failed = rng.random(runs) < 0.05 + 0.9 * (points[:, 0] > rng.random()) * (points[:, 1] > 0.3)
        for zone in zones(points, failed, weights, [count, 0], most=1):
            inside = ((points >= zone.bounds[:, 0]) & (points <= zone.bounds[:, 1])).all(axis=1)
            assert (int(inside.sum()), int(failed[inside].sum())) == (zone.runs, zone.failed)
            first, last = np.round(zone.bounds[0] * count).astype(int)
            named = " or ".join(f"o{k}" for k in range(first, last))
            assert (f"object {named}" in zone.text(space).split(", ")) == (last - first < count)


def test_two_boxes_are_two_zones():
    _, points, weights = drawn(1, 1200)
    failed = (points[:, 0] > 0.85) | (points[:, 3] < 0.1)
    found = zones(points, failed, weights)
    texts = " / ".join(zone.text(SPACE) for zone in found[:2])
    assert "mass_kg above" in texts
    assert "other_0 below" in texts


def test_without_failures_there_is_no_zone():
    _, points, weights = drawn()
    assert zones(points, np.zeros(len(points), bool), weights) == []
    few = np.zeros(len(points), bool)
    few[:3] = True
    assert zones(points, few, weights) == []


def test_noise_has_zones_in_few_campaigns():
    campaigns = 0
    for seed in range(10):
        rng, points, weights = drawn(seed, 240)
        campaigns += bool(zones(points, rng.random(len(points)) < 0.1, weights))
    assert campaigns <= 2
