"""Refits of the learner `fused`: without the scored object, on the other setup, or without real frames."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from lsds.errors import DataError
from lsds.registry.host import PluginHost
from lsds_research.datasets import Dataset, merged
from lsds_research.evaluation.fitting import Model, fit, task
from lsds_research.slips.folder import LabelledRecording, as_dataset
from lsds_research.windows import windows

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts.learning import Fitted, Learner

    Floats = NDArray[np.float64]

LEARNER = "fused"


def refitted(
    recordings: Sequence[LabelledRecording],
    group: Callable[[LabelledRecording], str],
    simulated: Dataset | None = None,
    learner: str = LEARNER,
) -> list[Floats] | None:
    """Return per recording the scores of its frames (n,), by a model fitted on other groups and on simulated
    recordings.

    None if the others do not show both slip and sticking.
    """
    built = _built(learner)
    groups = np.array([group(own) for own in recordings])
    scores: list[Floats] = [np.empty(0)] * len(recordings)
    for name in np.unique(groups):
        others = [own for own, theirs in zip(recordings, groups, strict=True) if theirs != name]
        try:
            real = as_dataset(others)
            fitted = _fitted(built, real if simulated is None else merged([("simulated", simulated), ("real", real)]))
        except DataError:
            return None
        for index in np.flatnonzero(groups == name).tolist():
            scores[index] = _scores(recordings[index], built, fitted)
    return scores


def zero_shot(recordings: Sequence[LabelledRecording], simulated: Dataset, learner: str = LEARNER) -> list[Floats]:
    """Return per recording the scores of its frames (n,), by a model fitted on simulated recordings alone.

    Raises DataError for an unusable dataset.
    """
    built = _built(learner)
    fitted = _fitted(built, simulated)
    return [_scores(own, built, fitted) for own in recordings]


def _built(learner: str) -> Learner:
    return Model(learner, own=True).build(PluginHost())


def _fitted(built: Learner, data: Dataset) -> Fitted:
    examples = task(data, built)
    return fit(built, examples.examples(np.arange(len(examples.rows))), 0)


def _scores(own: LabelledRecording, built: Learner, fitted: Fitted) -> Floats:
    """Return the score of each frame (n,), NaN if one of its signals is unknown."""
    x, rows = windows(as_dataset([own]), built.signals, built.length)
    scores = np.full(own.outputs.count, np.nan)
    if len(rows):
        scores[rows] = fitted.predict(x)
    return scores
