"""Scores of detectors with the paper's split and by recording and object, with baselines and controls."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds_research.evaluation.controls import rule_score, rule_threshold, shuffled
from lsds_research.evaluation.fitting import Model, Task, fit, labelled, out_of_fold, task
from lsds_research.metrics import bootstrap, classification, onsets
from lsds_research.splits import SplitName, each_and_all, folds, random_folds

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.registry.host import PluginHost
    from lsds_research.datasets import Dataset

FOLDS = 5
"""Number of folds of the cross-validation."""
THRESHOLD = 0.5
"""Probability of slip above which a frame counts as slip: slip is likelier than rest."""
Row = dict[str, Any]


def split(own: Task, by: SplitName, seed: int) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Yield training and test rows. The paper's split is over frames at random, and leaks."""
    slip = own.column("slip")
    if by == "frames":
        return random_folds(slip, FOLDS, seed)
    groups = own.column(by)
    return folds(groups, slip, min(FOLDS, len(set(groups.tolist()))), seed)


def cross_validate(
    data: Dataset, model: Model, host: PluginHost, by: SplitName, seed: int = 0, *, labels: str = "measured"
) -> Row:
    """Return one row of scores; `labels` "shuffled" is a control that must score at chance."""
    learner = model.build(host)
    own = task(shuffled(data, seed) if labels == "shuffled" else data, learner)
    score = out_of_fold(learner, own, split(own, by, seed), seed, model.most)
    return {"model": model.name, "split": by, "labels": labels} | scored(own, score)


def scored(own: Task, score: NDArray[Any], threshold: float | NDArray[Any] = THRESHOLD) -> Row:
    """Return accuracy with its interval, precision, recall, F1, false positive rate, AUC; with known times also
    onset latency and false alarms per minute. "accuracy_all" is over all labelled frames: a frame without a prediction
    counts as rest, because the loop then acts as at rest."""
    slip = own.column("slip") == 1
    predicted = np.asarray(score > threshold)
    right = (predicted == slip).astype(float)
    interval = bootstrap(own.column("recording"), lambda rows: float(right[rows].mean()))
    latency, alarms = onsets(own.column("recording"), own.column("t_s"), slip, predicted)
    found = latency[np.isfinite(latency)]
    silent = own.data["slip"][own.unanswered] != 1
    return {
        **classification(slip, predicted, score - threshold),
        "accuracy_all": float(np.concatenate([right, silent]).mean()),
        "accuracy_low": interval.low,
        "accuracy_high": interval.high,
        "onset_latency_s": float(np.median(found)) if len(found) else None,
        "onsets_missed": float(np.mean(~np.isfinite(latency))) if len(latency) else None,
        "false_alarms_per_min": alarms,
        "frames": len(slip),
        "answered": own.answered,
    }


def one_parameter(data: Dataset, by: SplitName, seed: int = 0) -> Row:
    """Return the row of the rule whose threshold is fitted on the training rows of each fold."""
    own = labelled(data, "detect")
    row = scored(own, *rule_out_of_fold(own, split(own, by, seed)))
    return {"model": "one-parameter rule", "split": by, "labels": "measured"} | row


def rule_out_of_fold(
    own: Task, parts: Iterable[tuple[NDArray[np.intp], NDArray[np.intp]]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the rule's score (n,) of a task's rows and, from the other folds, its threshold (n,)."""
    score = rule_score(own.data)[own.rows]
    threshold = np.zeros(len(score))
    for train, test in parts:
        threshold[test] = rule_threshold(score[train], own.column("slip")[train] == 1)
    return score, threshold


def majority(own: Task) -> Row:
    """Return the row of the majority-class predictor."""
    slip = own.column("slip") == 1
    predicted = np.full(len(slip), slip.mean() > 0.5)
    return {"model": "majority", "split": "-", "labels": "measured", "frames": len(slip)} | classification(
        slip, predicted, predicted.astype(float)
    )


def unseen(train: Dataset, test: Dataset, models: Sequence[Model], host: PluginHost, seed: int = 0) -> list[Row]:
    """Return a row for each model and object of `test`, after fitting on all of `train`.

    The last rows are those of the one-parameter rule and of the majority-class predictor.
    """
    rows: list[Row] = []
    for model in models:
        learner = model.build(host)
        own, other = task(train, learner), task(test, learner)
        predicted = fit(learner, own.examples(np.arange(len(own.rows))), seed, model.most).predict(other.x)
        rows += by_object(model.name, other, predicted, THRESHOLD)
    fitted, rule = labelled(train, "detect"), labelled(test, "detect")
    threshold = rule_threshold(rule_score(train)[fitted.rows], fitted.column("slip") == 1)
    rows += by_object("one-parameter rule", rule, rule_score(test)[rule.rows], threshold)
    usual = np.full(len(rule.rows), float(np.mean(fitted.column("slip") == 1) > THRESHOLD))
    return rows + by_object("majority", rule, usual, THRESHOLD)


def by_object(name: str, own: Task, score: NDArray[Any], threshold: float) -> list[Row]:
    """Return a row for each object of a task and one for all of them."""
    return [
        {"model": name, "object": which} | scored(own.part(rows), score[rows], threshold)
        for which, rows in each_and_all(own.column("object"))
    ]
