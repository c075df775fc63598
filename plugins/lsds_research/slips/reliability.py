"""The probability of slip for a detector's score, from its scores on objects that it was not fitted on.

A logistic function of the score's log-odds (Platt 1999), and the share of slip in bins of the score. The prior odds are
those of the scored frames. For other data use the likelihood ratio: the calibrated odds over the prior odds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds_research.slips.score import scored_frames

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_research.slips.folder import LabelledRecording

    Floats = NDArray[np.float64]

SCORE_BIN_EDGES = (0.0, 0.05, 0.1, 0.2, 0.4, 0.6, 0.75, 0.85, 0.95, 1.0)
"""Edges of the bins of the score."""
NEAREST = 1e-4
"""Minimum distance of scores from 0 and 1, where log-odds are infinite."""


def reliability(recordings: Sequence[LabelledRecording], scores: Sequence[Floats], seed: int = 0) -> dict[str, Any]:
    """Return calibration, curve and Brier scores of a detector, over frames that slip and frames that move and stick.

    `scores` (n,) of each recording must come from a model fitted without its object. Also returned are the Brier score
    of the base rate and that of labels shuffled within the frames.
    """
    score, slips = _frames(recordings, scores)
    odds = log_odds(score)
    offset, slope = _fitted(odds, slips)
    probability = _logistic(offset + slope * odds)
    shuffled = np.random.default_rng(seed).permutation(slips)
    prior = float(slips.mean())
    curve = []
    for low, high in pairwise(SCORE_BIN_EDGES):
        inside = (score >= low) & ((score < high) | (high == SCORE_BIN_EDGES[-1]))
        if inside.any():
            share = round(float(slips[inside].mean()), 4)
            curve.append({"from": low, "to": high, "frames": int(inside.sum()), "slip_share": share})
    return {
        "how": "objects left out in turn; frames that slip, or move and stick",
        "frames": len(score),
        "prior": round(prior, 4),
        "offset": round(offset, 4),
        "slope": round(slope, 4),
        "curve": curve,
        "brier": _brier(probability, slips),
        "brier_base_rate": _brier(np.full(len(slips), prior), slips),
        "brier_shuffled": _brier(probability, shuffled),
    }


def log_odds(score: Floats) -> Floats:
    """Return the natural logarithm of the odds of a score in [0, 1]."""
    kept = np.clip(score, NEAREST, 1 - NEAREST)
    return np.asarray(np.log(kept / (1 - kept)))


def log_likelihood_ratio(score: Floats, card: dict[str, Any]) -> Floats:
    """Return the log likelihood ratio of slip for a score, by a card's reliability."""
    prior = math.log(card["prior"] / (1 - card["prior"]))
    return np.asarray(card["offset"] + card["slope"] * log_odds(score) - prior)


def _frames(recordings: Sequence[LabelledRecording], scores: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Return the detector scores of all scored frames with an answer, and whether they slip (1 or 0)."""
    used_scores, slips = [np.empty(0)], [np.empty(0)]
    for own, score in zip(recordings, scores, strict=True):
        frames = scored_frames(own.intervals, own.outputs.moved_px)
        used = (frames.slip | frames.moving) & np.isfinite(score)
        used_scores.append(score[used])
        slips.append(frames.slip[used].astype(float))
    return np.concatenate(used_scores), np.concatenate(slips)


def _fitted(odds: Floats, slips: Floats) -> tuple[float, float]:
    """Return offset and slope of the logistic function."""
    offset, slope = _logistic_weights(np.stack([np.ones(len(odds)), odds], axis=1), slips)
    return float(offset), float(slope)


def _logistic_weights(rows: Floats, labels: Floats) -> Floats:
    """Return the weights (k,) of a logistic function of rows (n, k) by Newton's method, for labels (n,) of 0 and 1.

    A weak prior keeps them finite.
    """
    found = np.zeros(rows.shape[1])
    prior = 1e-3 * np.eye(rows.shape[1])
    for _ in range(50):
        p = _logistic(rows @ found)
        weight = p * (1 - p)
        gradient = rows.T @ (labels - p) - prior @ found
        step = np.linalg.solve((rows * weight[:, None]).T @ rows + prior, gradient)
        found = found + step
        if np.abs(step).max() < 1e-9:
            break
    return found


def _logistic(odds: Floats) -> Floats:
    return np.asarray(1 / (1 + np.exp(-np.clip(odds, -30.0, 30.0))))


def _brier(probability: Floats, slips: Floats) -> float:
    return round(float(np.mean((probability - slips) ** 2)), 4)
