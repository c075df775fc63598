"""Detector `fused`: how trees and imprint are joined, and cards that cannot be used."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lsds_plugins.detectors.fused import FusedDetector, Fusion
from lsds_plugins.detectors.learned import LearnedOptions

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext
from lsds.errors import ModelError

CARD = {
    "trees": [-2.0, 1.0],
    "imprint": [-3.5, 2.3],
    "trees_limit": 0.02,
    "imprint_limits": [0.3, 10.0],
    "threshold": 0.6,
}
FUSION = Fusion.of_card(CARD)
probabilities, scores = st.floats(0, 1), st.floats(0, 1e6)


@given(probabilities, probabilities, scores, scores)
def test_more_evidence_of_either_kind_is_never_less_slip(one, other, first, second):
    low, high = sorted((one, other))
    weak, strong = sorted((first, second))
    assert FUSION.probability(low, weak) <= FUSION.probability(high, strong)
    assert 0 < FUSION.probability(low, weak) < 1


@given(probabilities, scores)
def test_without_an_imprint_the_trees_need_more(trees, score):
    assert FUSION.probability(trees, math.nan) <= FUSION.probability(trees, score)


def test_trees_alone_are_not_believed_without_limit():
    assert FUSION.probability(1.0, math.nan) == FUSION.probability(0.98, math.nan)
    assert FUSION.probability(0.9, math.nan) < FUSION.threshold < FUSION.probability(0.9, 3.0)


@given(probabilities, scores)
def test_either_piece_of_evidence_is_enough(trees, score):
    both = FUSION.probability(trees, score)
    assert both >= FUSION.probability(0.0, score) - 1e-12
    assert both >= FUSION.probability(trees, 0.0) - 1e-12
    assert FUSION.probability(1.0, 1.0) > FUSION.threshold
    assert FUSION.probability(0.0, 10.0) > FUSION.threshold


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"trees": None}, "incomplete"),
        ({"imprint": [1.0]}, "incomplete"),
        ({"imprint": [0.0, -1.0]}, "exclude"),
        ({"imprint_limits": [1.0]}, "incomplete"),
        ({"imprint_limits": [0.0, 1.0]}, "exclude"),
        ({"threshold": 1.0}, "exclude"),
        ({"trees_limit": 0.5}, "exclude"),
    ],
)
def test_a_card_that_cannot_be_used_is_refused(change, message):
    with pytest.raises(ModelError, match=message):
        Fusion.of_card(CARD | change)


def test_a_threshold_of_the_config_replaces_that_of_the_card():
    context = BuildContext(VirtualClock(), 0)
    shipped = FusedDetector(LearnedOptions(), context)
    own = FusedDetector(LearnedOptions(threshold=0.9), context)
    assert shipped._threshold == shipped.card.real["fusion"]["threshold"]
    assert own._threshold == 0.9
