"""Scores of estimators: leave one object out, unseen objects; the zero and the contact predictor beside them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.learning.evaluation.controls import contact_constant, in_contact, shuffled
from lsds.learning.evaluation.fitting import Model, Task, fit, labelled, out_of_fold, task
from lsds.learning.metrics import bootstrap, coverage, regression
from lsds.learning.splits import folds, leave_one_out

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.learning.datasets import Dataset
    from lsds.plugins.host import PluginHost

SPEED, RATE = 3, 2
"""Columns of an estimator's answer: speed, angular velocity; their standard deviations are four further on."""
NINETY = 1.6449
MOVING_RAD_S = 0.05
CALIBRATED_ON = 12_000
"""Windows at most that models are fitted on whose errors calibrate another's intervals: a little worse, and so on the
safe side."""
Row = dict[str, Any]


def true_speed(own: Task) -> NDArray[np.float64]:
    """Return the measured speed (n,) in m/s."""
    return np.asarray(np.hypot(own.y[:, 0], own.y[:, 1]), np.float64)


def leave_objects_out(
    data: Dataset, model: Model, host: PluginHost, seed: int = 0, *, labels: str = "measured", groups: int = 0
) -> Row:
    """Return one row of scores, every object answered by a model that has not seen it; `groups` > 0 leaves out so many
    groups of objects in place of single ones."""
    learner = model.build(host)
    own = task(shuffled(data, seed) if labels == "shuffled" else data, learner)
    objects = own.column("object")
    parts = (
        folds(objects, (true_speed(own) > 1e-3).astype(int), groups, seed)
        if groups
        else ((train, test) for _, train, test in leave_one_out(objects))
    )
    row = scored(own, out_of_fold(learner, own, parts, seed, model.most))
    # Nobody has calibrated these intervals.
    return {"model": model.name, "labels": labels} | {k: v for k, v in row.items() if not k.endswith("coverage")}


def scored(own: Task, said: NDArray[Any], intervals: Sequence[float] = (NINETY,) * 4) -> Row:
    """Return MAE (with interval), RMSE, R2, moving only, the angular error and the coverage of 90 % intervals."""
    true = true_speed(own)
    speed, spread = said[:, SPEED].astype(float), said[:, SPEED + 4].astype(float)
    off = np.abs(speed - true)
    interval = bootstrap(own.column("recording"), lambda rows: float(off[rows].mean()))
    half = intervals[SPEED] * spread
    return {
        **regression(true, speed),
        "mae_low": interval.low,
        "mae_high": interval.high,
        "coverage": coverage(true, speed - half, speed + half),
        "interval_width": float(2 * half.mean()),
        **_angular(own, said, intervals[RATE]),
        "frames": len(true),
        "answered": own.answered,
    }


def _angular(own: Task, said: NDArray[Any], factor: float) -> Row:
    true, rate = own.y[:, RATE].astype(float), said[:, RATE].astype(float)
    turning = np.abs(true) > MOVING_RAD_S
    half = factor * said[:, RATE + 4]
    relative = float(np.abs(rate - true)[turning].sum() / np.abs(true)[turning].sum()) if turning.any() else None
    return {
        "angular_mae": float(np.abs(rate - true).mean()),
        "angular_relative_error": relative,
        "angular_coverage": coverage(true, rate - half, rate + half),
    }


def plain(own: Task, name: str, speed: NDArray[np.float64]) -> Row:
    """Return the row of a predictor that has a speed only."""
    true = true_speed(own)
    off = np.abs(speed - true)
    interval = bootstrap(own.column("recording"), lambda rows: float(off[rows].mean()))
    return {
        "model": name, "labels": "measured", **regression(true, speed), "mae_low": interval.low,
        "mae_high": interval.high, "frames": len(true),
    }  # fmt: skip


def baselines(train: Dataset, test: Dataset) -> list[Row]:
    """Return the rows of "always zero" and "a constant while there is contact", the constant from `train`; where that
    is `test` itself, for each object from the others."""
    own, fitted = labelled(test, "estimate"), labelled(train, "estimate")
    objects = own.column("object")
    touching = in_contact(own.column("area").astype(float))
    area, speed = fitted.column("area").astype(float), true_speed(fitted)
    constant = np.full(len(objects), contact_constant(area, speed))
    if train is test and len(set(objects.tolist())) > 1:
        for _, others, left in leave_one_out(objects):
            constant[left] = contact_constant(area[others], speed[others])
    return [
        plain(own, "always zero", np.zeros(len(objects))),
        plain(own, "constant in contact", np.asarray(constant * touching, np.float64)),
    ]


def conformal(own: Task, said: NDArray[Any], level: float = 0.9) -> tuple[float, ...]:
    """Return factors for the standard deviations of vx, vy, angular velocity and speed, from answers out of fold: each
    is the quantile of |error| over standard deviation (split conformal prediction with a normalised score)."""
    true = np.column_stack([own.y, true_speed(own)])
    ratio = np.abs(said[:, :4] - true) / np.maximum(said[:, 4:], 1e-9)
    rank = min(1.0, level * (1 + 1 / len(ratio)))
    return tuple(float(v) for v in np.quantile(ratio, rank, axis=0))


def unseen(
    train: Dataset, test: Dataset, models: Sequence[Model], host: PluginHost, seed: int = 0,
    tick: Callable[[str], None] = lambda name: None,
) -> list[Row]:  # fmt: skip
    """Return a row for each model and object of `test`, fitted on `train`; intervals calibrated on objects left out of
    a first fit; the two plain predictors' rows last."""
    rows: list[Row] = []
    for model in models:
        learner = model.build(host)
        own, other = task(train, learner), task(test, learner)
        moving = (true_speed(own) > 1e-3).astype(int)
        by = "object" if len(set(own.column("object").tolist())) > 2 else "recording"
        most = min(model.most, CALIBRATED_ON) if model.most else CALIBRATED_ON
        factors = conformal(own, out_of_fold(learner, own, folds(own.column(by), moving, 3, seed), seed, most))
        said = fit(learner, own.examples(np.arange(len(own.rows))), seed, model.most).predict(other.x)
        objects = other.column("object")
        for which in [*dict.fromkeys(objects.tolist()), "all"]:
            index = np.flatnonzero((objects == which) | (which == "all"))
            rows.append({"model": model.name, "object": which} | scored(other.part(index), said[index], factors))
        tick(model.name)
    for which in [*dict.fromkeys(test["object"].tolist()), "all"]:
        part_of = test.where((test["object"] == which) | (which == "all"))
        rows += [{**row, "object": which} for row in baselines(train, part_of)]
    return rows
