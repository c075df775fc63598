"""Fits how the detector `fused` combines its trees with `imprint`, on objects that its trees did not see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from lsds_plugins.detectors.fused import Fusion

from lsds.calibration.thresholds import Budget, threshold
from lsds.errors import DataError
from lsds_research.slips.reliability import reliability
from lsds_research.slips.score import Counts, counted, scored_frames

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_research.slips.folder import LabelledRecording

    Floats = NDArray[np.float64]

TREES_LIMIT = 0.02
"""Least distance of the trees' probability from 0 and 1: they are fitted on some 50 real slips."""
IMPRINT_LIMITS = (0.3, 10.0)
"""Score of `imprint` below which the imprint rests, and that of an imprint that was too fast to follow."""
FIRST_WEIGHTS = (-3.0, 1.0, -3.0, 2.0)
"""Offsets and slopes with which the fit begins; chosen."""
LEAST_FITTED = 1e-6
"""Minimum distance of a probability from 0 and 1 in the fit; chosen."""
LEAST_SLOPE = 1e-3
"""Least slope: more evidence is more slip."""
ALARMS = 5.0
"""False alarms per 100 moving frames at the fitted threshold, with objects left out."""


def fitted_fusion(recordings: Sequence[LabelledRecording], scores: Sequence[Floats]) -> dict[str, Any]:
    """Return the entry `real.fusion` of the card: the function, its threshold, and its scores on objects left out.

    `scores` (n,) of each recording are those of trees that were fitted without its object. Raises DataError if the
    recordings do not show both slip and sticking.
    """
    plain = Fusion((0.0, 1.0), (0.0, 1.0), TREES_LIMIT, IMPRINT_LIMITS, 0.5)
    rows = [_rows(plain, own, score) for own, score in zip(recordings, scores, strict=True)]
    left_out: list[Floats] = [np.empty(0)] * len(recordings)
    for name in {own.object for own in recordings}:
        others = [index for index, own in enumerate(recordings) if own.object != name]
        weights = _weights([recordings[index] for index in others], [rows[index] for index in others])
        for index, own in enumerate(recordings):
            if own.object == name:
                left_out[index] = _probability(rows[index], weights)
    moving = [
        np.nan_to_num(score, nan=-np.inf)[scored_frames(own.intervals, own.outputs.moved_px).moving]
        for own, score in zip(recordings, left_out, strict=True)
    ]
    least = threshold(np.concatenate(moving), np.empty(0), Budget(ALARMS))
    if not 0 < least < 1:
        raise DataError("the labelled recordings move too little to set a threshold")
    found = [round(value, 3) for value in _weights(recordings, rows).tolist()]
    fusion = replace(plain, trees=(found[0], found[1]), imprint=(found[2], found[3]), threshold=round(least, 3))
    counts = Counts()
    for own, score in zip(recordings, left_out, strict=True):
        counts += counted(own.with_slip(np.where(np.isfinite(score), score > least, np.nan)))
    return {
        **asdict(fusion),
        "found": round(counts.recall, 4),
        "noticed": round(counts.noticed_share, 4),
        "false_alarms_per_100_moving": round(counts.per_100_moving, 4),
        "reliability": reliability(recordings, left_out),
    }


def _rows(plain: Fusion, own: LabelledRecording, score: Floats) -> Floats:
    """Return the evidence of trees and imprint (n, 2); NaN if the trees abstain."""
    imprint = own.outputs.score["imprint"]
    rows = [
        plain.evidence(trees, other) if np.isfinite(trees) else (np.nan, np.nan)
        for trees, other in zip(score.tolist(), imprint.tolist(), strict=True)
    ]
    return np.array(rows, float).reshape(-1, 2)


def _weights(recordings: Sequence[LabelledRecording], rows: Sequence[Floats]) -> Floats:
    """Return offset and slope of the trees and of the imprint (4,), fitted on all scored frames with an answer."""
    from scipy.optimize import minimize

    used, slips = [], []
    for own, row in zip(recordings, rows, strict=True):
        frames = scored_frames(own.intervals, own.outputs.moved_px)
        kept = (frames.slip | frames.moving | frames.still) & np.isfinite(row[:, 0])
        used.append(row[kept])
        slips.append(frames.slip[kept])
    evidence, labels = np.concatenate(used), np.concatenate(slips)
    if not 0 < labels.sum() < len(labels):
        raise DataError("the labelled recordings do not show both slip and sticking")

    def surprise(weights: Floats) -> float:
        probability = np.clip(_probability(evidence, weights), LEAST_FITTED, 1 - LEAST_FITTED)
        return -float(np.sum(np.log(np.where(labels, probability, 1 - probability))))

    found = minimize(
        surprise, FIRST_WEIGHTS, method="Nelder-Mead", options={"maxiter": 4000, "xatol": 1e-3, "fatol": 1e-3}
    )
    if not found.success or min(found.x[1], found.x[3]) < LEAST_SLOPE:
        raise DataError(f"trees and imprint do not show slip on the labelled recordings: {found.message}, {found.x}")
    return np.asarray(found.x)


def _probability(rows: Floats, weights: Floats) -> Floats:
    """Return the probability of slip (n,) for evidence (n, 2), as `Fusion.probability`."""
    neither = (1 + np.exp(weights[0] + weights[1] * rows[:, 0])) * (1 + np.exp(weights[2] + weights[3] * rows[:, 1]))
    return np.asarray(1 - 1 / neither)
