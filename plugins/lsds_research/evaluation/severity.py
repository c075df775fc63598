"""Scores of estimators on left-out and held-out objects, with the zero and the constant-in-contact baselines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.models.intervals import RATE_COLUMN, SPEED_COLUMN, Factors, conformal
from lsds_research.evaluation.controls import contact_constant, in_contact, shuffled
from lsds_research.evaluation.fitting import Model, Task, fit, out_of_fold, task
from lsds_research.metrics import MOVING_M_S, bootstrap, coverage, regression
from lsds_research.splits import each_and_all, folds, leave_one_out

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts.learning import Fitted, Learner
    from lsds.registry.host import PluginHost
    from lsds_research.datasets import Dataset

MOVING_RAD_S = 0.05
"""True angular velocity above which a frame counts as turning, rad/s; chosen."""
CALIBRATED_ON = 8_000
"""Maximum number of windows for fits whose errors calibrate the intervals of another model. Such fits are slightly
worse, which makes the intervals conservative."""
UNSCALED = Factors()
"""Interval factors of normally distributed errors with the model's standard deviations."""
Row = dict[str, Any]


def true_speed(own: Task) -> NDArray[np.float64]:
    """Return the measured speed (n,) in m/s."""
    return np.asarray(np.hypot(own.y[:, 0], own.y[:, 1]), np.float64)


def leave_objects_out(
    data: Dataset, model: Model, host: PluginHost, seed: int = 0, *, labels: str = "measured", groups: int = 0
) -> Row:
    """Return one row of scores, each object predicted by a model not trained on it; `groups` > 0 leaves out that many
    groups of objects instead of single objects."""
    learner = model.build(host)
    own = task(shuffled(data, seed) if labels == "shuffled" else data, learner)
    objects = own.column("object")
    parts = (
        folds(objects, (true_speed(own) > 1e-3).astype(int), groups, seed)
        if groups
        else ((train, test) for _, train, test in leave_one_out(objects))
    )
    row = scored(own, out_of_fold(learner, own, parts, seed, model.most))
    # These intervals are not calibrated.
    return {"model": model.name, "labels": labels} | {k: v for k, v in row.items() if not k.endswith("coverage")}


def scored(own: Task, predicted: NDArray[Any], factors: Factors = UNSCALED) -> Row:
    """Return MAE (with interval), RMSE and R2, the same for moving frames, the angular error, and the coverage of 90 %
    intervals over all frames and over frames with motion or rotation."""
    true = true_speed(own)
    speed = predicted[:, SPEED_COLUMN].astype(float)
    off = np.abs(speed - true)
    interval = bootstrap(own.column("recording"), lambda rows: float(off[rows].mean()))
    widths = factors.half_widths(predicted)
    half, moving = widths[:, SPEED_COLUMN], true > MOVING_M_S
    return {
        **regression(true, speed),
        "mae_low": interval.low,
        "mae_high": interval.high,
        "coverage": coverage(true, speed - half, speed + half),
        "moving_coverage": coverage(true[moving], (speed - half)[moving], (speed + half)[moving]),
        "interval_width": float(2 * half.mean()),
        **_angular(own, predicted, widths[:, RATE_COLUMN]),
        "frames": len(true),
        "answered": own.answered,
    }


def by_object(name: str, own: Task, predicted: NDArray[Any], factors: Factors) -> list[Row]:
    """Return a row for each object of a task and one for all of them."""
    return [
        {"model": name, "object": which} | scored(own.part(rows), predicted[rows], factors)
        for which, rows in each_and_all(own.column("object"))
    ]


def _angular(own: Task, predicted: NDArray[Any], half: NDArray[np.float64]) -> Row:
    true, rate = own.y[:, RATE_COLUMN].astype(float), predicted[:, RATE_COLUMN].astype(float)
    turning = np.abs(true) > MOVING_RAD_S
    relative = float(np.abs(rate - true)[turning].sum() / np.abs(true)[turning].sum()) if turning.any() else None
    return {
        "angular_mae": float(np.abs(rate - true).mean()),
        "angular_relative_error": relative,
        "angular_coverage": coverage(true, rate - half, rate + half),
        "turning_coverage": coverage(true[turning], (rate - half)[turning], (rate + half)[turning]),
    }


def plain(own: Task, name: str, speed: NDArray[np.float64]) -> Row:
    """Return the row of a predictor that has a speed only."""
    true = true_speed(own)
    off = np.abs(speed - true)
    interval = bootstrap(own.column("recording"), lambda rows: float(off[rows].mean()))
    return {
        "model": name,
        "labels": "measured",
        **regression(true, speed),
        "mae_low": interval.low,
        "mae_high": interval.high,
        "frames": len(true),
    }


def plain_speeds(fitted: Task, own: Task) -> dict[str, NDArray[np.float64]]:
    """Return the speeds (n,) of the baselines "always zero" and "constant in contact". The constant is fitted on
    `fitted`; if that is `own` itself, for each object on the others, or for each recording if there is one object
    only."""
    objects = own.column("object")
    area, speed = fitted.column("area").astype(float), true_speed(fitted)
    constant = np.full(len(objects), contact_constant(area, speed))
    groups = objects if len(set(objects.tolist())) > 1 else own.column("recording")
    if fitted is own and len(set(groups.tolist())) > 1:
        for _, others, left in leave_one_out(groups):
            constant[left] = contact_constant(area[others], speed[others])
    touching = in_contact(own.column("area").astype(float))
    return {"always zero": np.zeros(len(objects)), "constant in contact": np.asarray(constant * touching, np.float64)}


def baselines(fitted: Task, own: Task) -> list[Row]:
    """Return the rows of the two baselines."""
    return [plain(own, name, speed) for name, speed in plain_speeds(fitted, own).items()]


def plain_unseen(fitted: Task, own: Task) -> list[Row]:
    """Return the baselines' rows for each object of a task and for all of them."""
    speeds, parts = plain_speeds(fitted, own), each_and_all(own.column("object"))
    return [
        {**plain(own.part(rows), name, speed[rows]), "object": which}
        for which, rows in parts
        for name, speed in speeds.items()
    ]


def calibration(own: Task, predicted: NDArray[Any]) -> Factors:
    """Return the interval factors from cross-validated predictions."""
    return conformal(np.column_stack([own.y, true_speed(own)]), predicted)


@dataclass(frozen=True, slots=True, eq=False)
class Calibrated:
    """A fitted model and the factors of its 90 % intervals."""

    model: Model
    learner: Learner
    fitted: Fitted
    factors: Factors

    def scored(self, test: Dataset) -> list[Row]:
        """Return a row for each object of `test` and one for all of them."""
        own = task(test, self.learner)
        return by_object(self.model.name, own, self.fitted.predict(own.x), self.factors)


def calibrated(train: Dataset, model: Model, host: PluginHost, seed: int = 0) -> Calibrated:
    """Fit on `train`; the intervals are calibrated on objects left out of a first fit."""
    learner = model.build(host)
    own = task(train, learner)
    moving = (true_speed(own) > 1e-3).astype(int)
    by = "object" if len(set(own.column("object").tolist())) > 2 else "recording"
    most = min(model.most, CALIBRATED_ON) if model.most else CALIBRATED_ON
    factors = calibration(own, out_of_fold(learner, own, folds(own.column(by), moving, 3, seed), seed, most))
    return Calibrated(model, learner, fit(learner, own.examples(np.arange(len(own.rows))), seed, model.most), factors)
