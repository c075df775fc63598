"""Scores of detectors and estimators, with confidence intervals over recordings.

Frames of a recording are not independent: the bootstrap draws recordings.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

MOVING_M_S = 1e-3
"""Slower motion does not count as slip (m/s)."""
_APART_S = 0.2
"""A detection this close to a slip belongs to it (s)."""


def scatter(values: Floats) -> float:
    """Return the standard deviation of a normal distribution with the same median absolute deviation."""
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))


def median_and_scatter(values: Floats) -> str:
    """Return the median of the finite values, their scatter and their number, as text."""
    known = values[np.isfinite(values)]
    return f"{np.median(known):+.2f}, scatter {scatter(known):.2f} ({len(known)})" if len(known) else "unknown"


@dataclass(frozen=True, slots=True)
class Interval:
    """A score and its 95 % bootstrap interval."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.value:.3f} [{self.low:.3f}, {self.high:.3f}]"


def classification(slip: NDArray[Any], predicted: NDArray[Any], score: NDArray[Any] | None = None) -> dict[str, float]:
    """Return accuracy, precision, recall, F1 and false positive rate of `predicted` (n,) against `slip` (n,), and the
    AUC of `score`; NaN for an undefined figure."""
    slip, predicted = np.asarray(slip, bool), np.asarray(predicted, bool)
    tp, fp = float(np.sum(slip & predicted)), float(np.sum(~slip & predicted))
    fn, tn = float(np.sum(slip & ~predicted)), float(np.sum(~slip & ~predicted))
    found = {
        "accuracy": _ratio(tp + tn, tp + tn + fp + fn),
        "precision": _ratio(tp, tp + fp),
        "recall": _ratio(tp, tp + fn),
        "f1": _ratio(2 * tp, 2 * tp + fp + fn),
        "false_positive_rate": _ratio(fp, fp + tn),
        "prevalence": _ratio(tp + fn, tp + tn + fp + fn),
    }
    if score is not None:
        found["auc"] = auc(slip, np.asarray(score, float))
    return found


def auc(slip: NDArray[Any], score: Floats) -> float:
    """Return the area under the ROC curve: how often a slip scores higher than a non-slip, ties counting half."""
    slip = np.asarray(slip, bool)
    positives, negatives = int(slip.sum()), int((~slip).sum())
    if not positives or not negatives:
        return math.nan
    _, place, counts = np.unique(score, return_inverse=True, return_counts=True)
    ranks = (np.cumsum(counts) - (counts - 1) / 2)[place]
    return float((ranks[slip].sum() - positives * (positives + 1) / 2) / (positives * negatives))


def regression(true: Floats, predicted: Floats) -> dict[str, float]:
    """Return MAE, RMSE and pooled R2 over all frames, and over those that move, in the units given (speed in m/s)."""
    true, predicted = np.asarray(true, float), np.asarray(predicted, float)
    moving = np.abs(true) > MOVING_M_S
    return {
        "mae": _mean(np.abs(predicted - true)),
        "rmse": math.sqrt(_mean((predicted - true) ** 2)),
        "r2": r2(true, predicted),
        "moving_mae": _mean(np.abs(predicted - true)[moving]),
        "moving_rmse": math.sqrt(_mean((predicted - true)[moving] ** 2)),
        "moving_r2": r2(true[moving], predicted[moving]),
        "moving_share": _mean(moving.astype(float)),
    }


def r2(true: Floats, predicted: Floats) -> float:
    """Return the coefficient of determination; NaN where the truth does not vary."""
    spread = float(((true - true.mean()) ** 2).sum()) if len(true) else 0.0
    return 1.0 - float(((predicted - true) ** 2).sum()) / spread if spread > 0 else math.nan


def bootstrap(
    recordings: NDArray[Any], score: Callable[[NDArray[np.intp]], float], draws: int = 300, seed: int = 0
) -> Interval:
    """Return a score of rows with its 95 % interval over recordings drawn with replacement."""
    names, own = np.unique(recordings, return_inverse=True)
    order = np.argsort(own, kind="stable")
    rows = np.split(order, np.cumsum(np.bincount(own))[:-1])
    rng = np.random.default_rng(seed)
    found = [score(np.concatenate([rows[k] for k in rng.integers(0, len(names), len(names))])) for _ in range(draws)]
    known = [value for value in found if not math.isnan(value)]
    low, high = np.quantile(known, (0.025, 0.975)) if known else (math.nan, math.nan)
    return Interval(score(np.arange(len(recordings))), float(low), float(high))


def onsets(
    recordings: NDArray[Any], t_s: Floats, slip: NDArray[Any], predicted: NDArray[Any], within_s: float = 0.5
) -> tuple[Floats, float]:
    """Return latencies (s) from each onset of slip to the first detection, infinite without one `within_s`, and
    false alarms per minute: runs of detections without slip within 0.2 s before or after.

    A detector that always reports slip has no latency, and one alarm per pause between slips.
    """
    latencies: list[float] = []
    alarms, still_s = 0, 0.0
    for name in np.unique(recordings):
        rows = np.flatnonzero(recordings == name)
        t, true, detected = t_s[rows], np.asarray(slip[rows], bool), np.asarray(predicted[rows], bool)
        for at in np.flatnonzero(true & ~np.concatenate([[True], true[:-1]])):
            after = detected & (t >= t[at]) & (t <= t[at] + within_s)
            latencies.append(float(t[np.argmax(after)] - t[at]) if after.any() else math.inf)
        steps = np.diff(t, prepend=t[0])
        # Frames without a prediction are missing here; the time between does not count as time without an alarm.
        steps = np.minimum(steps, 2 * np.median(steps[1:]) if len(steps) > 1 else 0.0)
        last_slip = np.maximum.accumulate(np.where(true, t, -math.inf))
        next_slip = np.minimum.accumulate(np.where(true, t, math.inf)[::-1])[::-1]
        quiet = ~true & (t - last_slip > _APART_S) & (next_slip - t > _APART_S)
        still_s += float(steps[quiet].sum())
        wrong = detected & quiet
        alarms += int(np.sum(wrong & ~np.concatenate([[False], wrong[:-1]])))
    return np.array(latencies), 60 * alarms / still_s if still_s > 0 else math.nan


def coverage(true: Floats, low: Floats, high: Floats) -> float:
    """Return the share of the truths that lie within their intervals."""
    return _mean(((true >= low) & (true <= high)).astype(float))


def _ratio(part: float, whole: float) -> float:
    return part / whole if whole else math.nan


def _mean(values: Floats) -> float:
    return float(values.mean()) if len(values) else math.nan
