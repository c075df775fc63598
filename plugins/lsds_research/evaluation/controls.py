"""Baselines and controls for every learned score: rules with one parameter or none, and the same learner on nuisance
signals or shuffled labels.

A learner that is only slightly better than the baselines has learned little; one that scores above chance on shuffled
labels, or on marker count and brightness, uses a leak.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds_research.datasets import Dataset
from lsds_research.evaluation.fitting import Model

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

RULE = "v_net"
"""The one-parameter rule's signal: the larger of the last two frames."""


def nuisance(model: Model) -> Model:
    """Return the same learner on nuisance signals, which must not separate slip from rest."""
    options = {**model.options, "signals": "nuisance"}
    return replace(model, options=options, title=f"{model.name}, nuisances only")


def rule_score(data: Dataset) -> Floats:
    """Return the larger of the last two frames' v_net (rows,), within recordings; zero where it is undefined."""
    score = np.nan_to_num(data[RULE].astype(float))
    before = np.concatenate([[0.0], score[:-1]])
    before[data.starts[:-1]] = 0.0
    return np.asarray(np.maximum(score, before))


def rule_threshold(score: Floats, slip: NDArray[Any]) -> float:
    """Return the threshold with the greatest accuracy on these rows: the rule's one parameter."""
    order = np.argsort(score, kind="stable")
    slips = np.asarray(slip, bool)[order]
    # With slip above position k, the non-slips up to k and the slips beyond it are correct.
    right = np.concatenate([[0], np.cumsum(~slips)]) + slips.sum() - np.concatenate([[0], np.cumsum(slips)])
    values = score[order]
    borders = np.concatenate([[-np.inf], (values[1:] + values[:-1]) / 2, [np.inf]])
    allowed = np.concatenate([[True], values[1:] > values[:-1], [True]])
    return float(borders[np.argmax(np.where(allowed, right, -1))])


def contact_constant(area: Floats, speed: Floats) -> float:
    """Return the least-squares constant c of the predictor "c in contact, else 0"."""
    touching = in_contact(area)
    return float(speed[touching].mean()) if touching.any() else 0.0


def in_contact(area: Floats) -> NDArray[np.bool_]:
    """Return whether the object is in contact (rows,): at least half a per cent of the image."""
    return np.asarray(np.nan_to_num(area) > 0.005)


def shuffled(data: Dataset, seed: int) -> Dataset:
    """Return the dataset with each recording's labels taken from another recording, stretched and cyclically shifted.

    Only the distribution of labels remains, so a score above chance shows a leak.
    """
    rng = np.random.default_rng(seed)
    spans = list(pairwise(data.starts.tolist()))
    source = rng.permutation(len(spans))
    rows = np.zeros(len(data), np.intp)
    for (first, end), other in zip(spans, source, strict=True):
        begin, stop = spans[other]
        stretched = begin + np.arange(end - first) * (stop - begin) // max(end - first, 1)
        # All protocols have the same order: rest, slide, rest. A random cyclic shift removes it.
        rows[first:end] = np.roll(stretched, rng.integers(0, end - first))
    from lsds_research.datasets import LABELS

    return Dataset(
        {name: values[rows] if name in LABELS else values for name, values in data.columns.items()}, data.card
    )
