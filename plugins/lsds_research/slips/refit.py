"""The learner `fused` fitted without the object it is scored on, and on the other setup than it is scored on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from lsds.errors import DataError
from lsds.models.signals import signal_indices
from lsds.plugins.host import PluginHost
from lsds_research.evaluation.fitting import Model, fit, task
from lsds_research.slips.folder import LabelledRecording, as_dataset

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


def refitted(
    recordings: Sequence[LabelledRecording], group: Callable[[LabelledRecording], str], learner: str = "fused"
) -> list[Floats] | None:
    """Return of each recording the score of each frame (n,) by a model fitted on the recordings of other groups.

    None where the others do not show both slip and sticking.
    """
    host, model = PluginHost(), Model(learner)
    built = model.build(host)
    if built.length != 1:
        raise DataError(f"learner {learner}: looks at {built.length} frames, and only one is supported here")
    columns = signal_indices(built.signals)
    groups = np.array([group(own) for own in recordings])
    scores: list[Floats] = [np.full(own.watched.count, np.nan) for own in recordings]
    for name in np.unique(groups):
        others = [own for own, theirs in zip(recordings, groups, strict=True) if theirs != name]
        try:
            examples = task(as_dataset(others), built)
            fitted = fit(built, examples.examples(np.arange(len(examples.rows))), 0)
        except DataError:
            return None
        for index in np.flatnonzero(groups == name).tolist():
            signals = recordings[index].watched.signals[:, columns]
            known = np.isfinite(signals).all(axis=1)
            if known.any():
                scores[index][known] = fitted.predict(signals[known][:, None, :])
    return scores
