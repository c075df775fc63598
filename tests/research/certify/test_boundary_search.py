"""The boundary search that a certificate is compared with: its second stage draws where outcomes are mixed."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("sklearn", reason="scikit-learn is not installed: pip install '.[search]'")
from research.certify.answering import answered
from research.certify.boundary_search import COARSE_SHARE, boundary, ranked

DIMENSIONS = 5


def height(points):
    return points[..., 0] + 0.5 * points[..., 1] - 1.1


def test_the_second_stage_draws_near_the_boundary():
    _, points = answered(boundary(DIMENSIONS, 288, 3, np.array), lambda point: -float(height(point)))
    coarse = round(COARSE_SHARE * 288 / 16) * 16
    assert len(points) == 288
    assert np.median(np.abs(height(points[coarse:]))) < 0.5 * np.median(np.abs(height(points[:coarse])))


def test_without_a_failure_it_goes_on():
    _, points = answered(boundary(DIMENSIONS, 96, 3, np.array), lambda point: 1.0)
    assert len(points) == 96


def test_models_rank_unseen_lifts_and_shuffled_outcomes_do_not():
    rng = np.random.default_rng(1)
    points, held_out = rng.random((300, DIMENSIONS)), rng.random((600, DIMENSIONS))
    auc = ranked(points, height(points) > 0, held_out, height(held_out) > 0, 0)
    assert auc["forest"] > 0.9
    assert auc["logistic"] > 0.9
    assert 0.3 < auc["shuffled"] < 0.7
