"""Train on the recordings of some objects and test on those of others, with confidence intervals.

A model gives every video a probability; that of a recording is the mean over its cameras. Scores are over recordings,
with intervals from recordings drawn with replacement.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.errors import DataError
from lsds_research.metrics import Interval, auc, bootstrap
from lsds_research.splits import folds

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_research.incipient.table import Videos

    Floats = NDArray[np.float64]

Predict = Callable[["Floats"], "Floats"]
Fit = Callable[["Floats", "NDArray[np.intp]", int], Predict]
"""Fits on x (n, F) and labels (n,) 0 or 1 with a seed; the result gives probabilities of slip (n,)."""

CLIP_FOLDS = 10
"""Maximum number of folds of a cross-validation; chosen."""


@dataclass(frozen=True, slots=True)
class Scored:
    """A row of the table: model, test data, scores. `spread` is the standard deviation of the AUC over repeats."""

    name: str
    unit: str
    auc: Interval
    accuracy: Interval
    spread: float = 0.0


def fold_count(objects: NDArray[Any]) -> int:
    """Return the number of folds for these objects: at least one object per fold, at most ten folds."""
    return min(CLIP_FOLDS, len(np.unique(objects)))


def require_both(slip: NDArray[np.intp], objects: NDArray[Any]) -> None:
    """Raise DataError if training and test objects cannot both have both labels."""
    for label, word in ((1, "with"), (0, "without")):
        found = np.unique(objects[slip == label])
        if len(found) < 2:
            raise DataError(
                f"recordings {word} slip are of {len(found)} object{'s' * (len(found) != 1)}, but training on some and "
                "testing on others takes at least two (add recordings, or name a training folder with --train)"
            )


def grouped(objects: NDArray[Any], slip: NDArray[np.intp], seed: int) -> Iterator[tuple[Any, Any]]:
    """Yield rows to train on and to test on; no object in both, and both labels always in the first.

    A fold that would leave only one label to train on is skipped; its rows get no probability.
    """
    for train, test in folds(objects, slip, fold_count(objects), seed):
        if len(np.unique(slip[train])) == 2:
            yield train, test


def cross_validated(
    fit: Fit, x: Floats, slip: NDArray[np.intp], objects: NDArray[Any], seed: int, tick: Callable[[], object]
) -> Floats:
    """Return (n,) the probability of each row by a model not trained on its object; 0.5 if there is no such model.
    `tick` is called for each fold."""
    probability = np.full(len(slip), 0.5)
    for train, test in grouped(objects, slip, seed):
        probability[test] = fit(x[train], slip[train], seed)(x[test])
        tick()
    return probability


def permuted(slip: NDArray[np.intp], recordings: NDArray[Any], seed: int) -> NDArray[np.intp]:
    """Return the labels permuted among recordings: all rows of a recording get the same label."""
    _, first, own = np.unique(recordings, return_index=True, return_inverse=True)
    shuffled: NDArray[np.intp] = np.random.default_rng(seed).permutation(slip[first])[own]
    return shuffled


def by_recording(recordings: NDArray[Any], values: Floats) -> Floats:
    """Return the mean over each recording's rows, in the order of the sorted names."""
    _, own = np.unique(recordings, return_inverse=True)
    mean: Floats = np.bincount(own, values) / np.bincount(own)
    return mean


def scored(
    name: str,
    recordings: NDArray[Any],
    slip: NDArray[np.intp],
    probability: Floats,
    threshold: float = 0.5,
    *,
    per_video: bool = False,
    seed: int = 0,
) -> Scored:
    """Return the scores of probabilities `probability` (repeats, n) of videos, against `slip` (n,) or (repeats, n).

    Each score is the mean over the repeats. `per_video` counts every camera's video as a separate decision; the
    intervals still draw recordings.
    """
    probability = np.atleast_2d(probability)
    slips = np.broadcast_to(slip, probability.shape)
    units = recordings
    if not per_video:
        slips = np.array([by_recording(recordings, row.astype(np.float64)).round() for row in slips]).astype(np.intp)
        probability = np.array([by_recording(recordings, row) for row in probability])
        units = np.unique(recordings)
    pairs = list(zip(slips, probability, strict=True))

    def area(rows: NDArray[np.intp]) -> float:
        return float(np.mean([auc(true[rows], predicted[rows]) for true, predicted in pairs]))

    def right(rows: NDArray[np.intp]) -> float:
        return float(np.mean([(predicted[rows] > threshold) == (true[rows] > 0) for true, predicted in pairs]))

    every = np.arange(len(units))
    spread = float(np.std([auc(true[every], predicted[every]) for true, predicted in pairs]))
    unit = "video" if per_video else "recording"
    return Scored(name, unit, bootstrap(units, area, seed=seed), bootstrap(units, right, seed=seed), spread)


def threshold_rule(x: Floats, slip: NDArray[np.intp], seed: int) -> Predict:
    """Fit one parameter: the threshold on x (n, 1) with the fewest errors on the training data."""
    values = np.nan_to_num(x[:, 0])
    cuts = np.unique(values)
    cuts = np.concatenate([[cuts[0] / 2], (cuts[1:] + cuts[:-1]) / 2, [2 * cuts[-1]]])
    errors = [np.count_nonzero((values > cut) != (slip > 0)) for cut in cuts]
    cut = float(max(cuts[int(np.argmin(errors))], 1e-12))

    def predict(rows: Floats) -> Floats:
        value: Floats = np.nan_to_num(rows[:, 0])
        return value / (value + cut)

    return predict


def majority_rule(x: Floats, slip: NDArray[np.intp], seed: int) -> Predict:
    """Fit the majority label."""
    most = float(np.mean(slip) > 0.5)
    return lambda rows: np.full(len(rows), most)


def trained_elsewhere(fit: Fit, train: Videos, test: Videos, seed: int) -> tuple[Floats, NDArray[np.bool_]]:
    """Return (n,) the probabilities of the test videos by a model of other objects' recordings, and which videos these
    are: objects that are tested are left out of the training. Raises DataError if nothing remains."""
    own = ~np.isin(train.object, np.unique(test.object))
    if len(np.unique(train.slip[own])) < 2:
        raise DataError("the folder to train on has no objects with and without slip that the other has not")
    return fit(train.clip[own], train.slip[own], seed)(test.clip), own
