"""The probability that a score stands for."""

from __future__ import annotations

import numpy as np
import pytest
from lsds_research.slips.folder import LabelledRecording
from lsds_research.slips.labels import Interval, State
from lsds_research.slips.outputs import Outputs
from lsds_research.slips.reliability import log_likelihood_ratio, reliability

from lsds.models.signals import SIGNALS


def recording(name, count, slips, seed):
    """A recording that moves, the second half of which slips."""
    half = count // 2
    own = [Interval(0, half - 1, State.STICK), Interval(half, count - 1, State.SLIP if slips else State.STICK)]
    nothing = np.zeros((count, len(SIGNALS)), np.float32)
    return LabelledRecording(name, own, Outputs(name, count, 63, np.ones(count), np.zeros(count, bool), nothing))


def drawn(seed=0, sharp=1.0):
    """Recordings, and scores whose log-odds are `sharp` times too large."""
    rng = np.random.default_rng(seed)
    recordings, scores = [], []
    for number in range(40):
        own = recording(f"r{number}", 200, True, number)
        slips = np.arange(200) >= 100
        true = rng.normal(np.where(slips, 1.5, -1.5), np.sqrt(3.0))  # log-likelihood ratio of itself
        recordings.append(own)
        scores.append(1 / (1 + np.exp(-sharp * true)))
    return recordings, scores


@pytest.mark.parametrize("sharp", [0.5, 1.0, 3.0])
def test_overconfident_scores_become_probabilities(sharp):
    found = reliability(*drawn(sharp=sharp))
    assert found["slope"] == pytest.approx(1 / sharp, rel=0.15)
    assert found["brier"] < 0.7 * found["brier_base_rate"]
    assert found["brier_shuffled"] > found["brier_base_rate"]
    shares = [each["slip_share"] for each in found["curve"]]
    assert shares == sorted(shares)


def test_the_likelihood_ratio_does_not_depend_on_how_often_the_frames_slip():
    found = reliability(*drawn())
    score = np.array([0.1, 0.5, 0.9])
    assert log_likelihood_ratio(score, found) == pytest.approx(np.log(score / (1 - score)), abs=0.3)


def test_frames_without_an_answer_are_left_out():
    recordings, scores = drawn()
    for score in scores:
        score[::2] = np.nan
    assert reliability(recordings, scores)["frames"] == pytest.approx(40 * 190 / 2, abs=60)
