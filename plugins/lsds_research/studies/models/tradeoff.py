"""Studies `detectors` and `estimators`: accuracy on unseen objects against microseconds an update, in one run.

Every learner is fitted on the training objects, with each set of signals and length of window, and scored on the
held-out objects. The time of an update is measured in the code of the running cell, with all models alternating on
the same frames of a simulated run, so that a noisy machine affects all equally.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.clock import perf_ns
from lsds.config import load_config
from lsds.contracts import BuildContext, Observation
from lsds.contracts.study import StudyResult, Value
from lsds.models.artefact import Card, save
from lsds.models.intervals import SPEED_COLUMN
from lsds.models.running import RunningModel
from lsds.registry.host import PluginHost
from lsds.runtime.rig import Rig
from lsds.support.extras import require
from lsds.tactile.perception import Perception
from lsds_research.datasets import Dataset
from lsds_research.evaluation import detection, severity
from lsds_research.evaluation.controls import rule_score
from lsds_research.evaluation.fitting import Model, Task, fit, labelled, task
from lsds_research.metrics import bootstrap, r2, regression
from lsds_research.studies.frame.cost import record
from lsds_research.studies.models.split_dataset import split_dataset
from lsds_research.studies.models.tradeoff_plot import plot
from lsds_research.windows import windows

if TYPE_CHECKING:
    from lsds.contracts.kinds import Kind
    from lsds.contracts.learning import Job
    from lsds_research.studies.models.options import DetectorsOptions, EstimatorsOptions, TradeoffOptions

SETS = ("baseline", "proposed", "combined", "field")
CHAIN_LENGTHS = (1, 3, 6, 12, 20)
"""Lengths of a model's window that are compared, frames; chosen."""
LEARNERS: dict[Job, tuple[str, ...]] = {
    "detect": ("random-forest", "gradient-boosting", "logistic", "field-mlp", "monotone"),
    "estimate": ("lstm", "mlp", "linear-window", "field-gru"),
}
UNTRAINED: dict[Job, tuple[str, ...]] = {"detect": ("threshold", "rigid-residual"), "estimate": ("field",)}
KINDS: dict[Job, Kind] = {"detect": "detector", "estimate": "estimator"}
COLUMNS = (
    ("model", "model", ""),
    ("signals", "signals", ""),
    ("length", "frames", "d"),
    ("update_us", "us an update", ".1f"),
    ("score", "score", ".4f"),
    ("low", "low", ".4f"),
    ("high", "high", ".4f"),
    ("answered", "answered", ".3f"),
    ("front", "Pareto", ""),
)


class TradeoffStudy:
    """A `Study` of one job."""

    timed = ("update_us", "front")

    def __init__(self, options: TradeoffOptions, context: BuildContext, job: Job) -> None:
        self.options, self._host, self._context = options, PluginHost(), context
        self._job: Job = job

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Fit, score and time. Raises DataError without a dataset with training and held-out objects."""
        require("numba", extra="sim", purpose="timing on the simulated cell")
        seen, other = split_dataset(self.options.data)
        todo = _planned(self._job)
        rows: list[dict[str, Value]] = []
        with TemporaryDirectory() as folder:
            models: dict[int, Callable[[Observation], Any]] = {}
            for index, (name, options) in enumerate(todo):
                row, path = self._fit(name, options, seen, other, Path(folder) / f"{index}.onnx")
                models[len(rows)] = RunningModel(path, self._job).update
                rows.append(row)
                tick(index + 1, len(todo) + 1)
            for name in UNTRAINED[self._job]:
                kind = KINDS[self._job]
                backend = self._host.build(kind, self._host.own(kind, name), {}, self._context)
                models[len(rows)] = backend.update
                rows.append(self._untrained(name, other))
            for index, us in self._time(models).items():
                rows[index]["update_us"] = us
        tick(len(todo) + 1, len(todo) + 1)
        _mark_front(rows)
        score = "accuracy" if self._job == "detect" else "R2 of speed"
        origin = seen.card.get("figures_are", "of unknown origin")
        title = f"{KINDS[self._job]}s on objects never seen, {origin}: {score} against time, one thread"
        notes = [
            f"score: {score}, 95 % interval over recordings; fitted on at most {self.options.most} windows",
            "answered: share of the labelled frames with all inputs of the model defined; the score is of those",
            "time: signals, window and model, median over the frames of one simulated run, all models in turns",
        ]
        return StudyResult(title, COLUMNS, rows, partial(plot, rows=rows, score=score, title=title), notes)

    def _fit(
        self, name: str, options: dict[str, Any], seen: Dataset, other: Dataset, path: Path
    ) -> tuple[dict[str, Value], Path]:
        learner = Model(name, options, own=True).build(self._host)
        own, test = task(seen, learner), task(other, learner)
        rng = np.random.default_rng(self.options.seed)
        count = min(self.options.most, len(own.rows))
        index = np.sort(rng.choice(len(own.rows), count, replace=False))
        fitted = fit(learner, own.examples(index), self.options.seed)
        origin = str(seen.card.get("figures_are", "unknown"))
        card = Card(name, self._job, tuple(learner.signals), learner.length, origin)
        save(path, fitted.export(), card)
        predicted = fitted.predict(test.x)
        row: dict[str, Value] = {
            "model": name,
            "signals": str(options.get("signals", "own")),
            "length": learner.length,
            **self._score(test, predicted),
        }
        return row, path

    def _score(self, test: Task, predicted: Any) -> dict[str, Value]:
        if self._job == "detect":
            return _detects(test, predicted, detection.THRESHOLD)
        return _estimates(test, predicted[:, SPEED_COLUMN])

    def _untrained(self, name: str, other: Dataset) -> dict[str, Value]:
        """Return the row of a rule computed from columns of the dataset, with its default parameters."""
        if name == "field":
            from lsds_plugins.estimators.field import FieldOptions, speed_of

            options = FieldOptions()
            x, rows = windows(other, ("residual_along", "residual_across", "rigid_speed", "rim_speed"), options.frames)
            speed = dict(zip(rows.tolist(), speed_of(x, options.gain).tolist(), strict=True))
            test = labelled(other, "estimate")
            test = test.part(np.flatnonzero(np.isin(test.rows, rows)))
            predicted = np.array([speed[row] for row in test.rows.tolist()])
            return {"model": name, "signals": "untrained", "length": options.frames, **_estimates(test, predicted)}
        from lsds_plugins.detectors.rigid_residual import RigidResidualOptions
        from lsds_plugins.detectors.threshold import ThresholdOptions

        own = labelled(other, "detect")
        if name == "threshold":
            score, limit = rule_score(other)[own.rows], ThresholdOptions().v_net_m_s
        else:
            score, limit = np.nan_to_num(own.column("residual_excess")), RigidResidualOptions().residual_m_s
        length = 2 if name == "threshold" else 1
        return {"model": name, "signals": "untrained", "length": length, **_detects(own, score, limit)}

    def _time(self, models: dict[int, Callable[[Observation], Any]]) -> dict[int, float]:
        config = load_config(None, [f"seed={self.options.seed}"], host=self._host)
        clip = record(config, self._host)
        rig = Rig(config, self._host)
        perception = Perception(rig.tracker, rig.sensor.spec, config.tactile)
        perception.start([clip.reference])
        frames = [perception.observe(frame)[0] for frame in clip.frames]
        times: dict[int, list[int]] = {index: [] for index in models}
        for turn in range(self.options.repeats + 1):
            for index, update in models.items():
                for observation in frames:
                    # A new frame: detector and estimator share steps in the loop, but here each is charged for them.
                    fresh = replace(observation)
                    begun = perf_ns()
                    update(fresh)
                    if turn:
                        times[index].append(perf_ns() - begun)
        return {index: float(np.median(own)) / 1e3 for index, own in times.items()}


def _planned(job: Job) -> list[tuple[str, dict[str, Any]]]:
    """Return every learner with every set of signals, and ours with every length of window."""
    found: list[tuple[str, dict[str, Any]]] = []
    for name in LEARNERS[job]:
        sets = [s for s in SETS if not (s == "field" and name in ("random-forest", "gradient-boosting"))]
        found += [(name, {"signals": signals}) for signals in sets]
    swept = {"detect": ("logistic", "field-mlp"), "estimate": ("linear-window", "field-gru", "lstm")}[job]
    found += [(name, {"length": length}) for name in swept for length in CHAIN_LENGTHS]
    return found


def _detects(own: Task, score: Any, limit: float) -> dict[str, Value]:
    row = detection.scored(own, score, limit)
    return {
        "score": row["accuracy"],
        "low": row["accuracy_low"],
        "high": row["accuracy_high"],
        "auc": row["auc"],
        "false_alarms_per_min": row["false_alarms_per_min"],
        "answered": own.answered,
    }


def _estimates(own: Task, speed: Any) -> dict[str, Value]:
    true = severity.true_speed(own)
    found = regression(true, speed)
    interval = bootstrap(own.column("recording"), lambda rows: r2(true[rows], speed[rows]))
    return {
        "score": found["r2"],
        "low": interval.low,
        "high": interval.high,
        "mae_m_s": found["mae"],
        "moving_mae_m_s": found["moving_mae"],
        "answered": own.answered,
    }


def _mark_front(rows: list[dict[str, Value]]) -> None:
    """Mark the Pareto front: no other model is at least as fast and more accurate."""
    for row in rows:
        us, score = float(row["update_us"] or 0), float(row["score"] or 0)
        beaten = any(float(other["update_us"] or 0) <= us and float(other["score"] or 0) > score for other in rows)
        beaten = beaten or math.isnan(score)
        row["front"] = "" if beaten else "*"


def detectors(options: DetectorsOptions, context: BuildContext) -> TradeoffStudy:
    """Factory of the study `detectors`."""
    return TradeoffStudy(options, context, "detect")


def estimators(options: EstimatorsOptions, context: BuildContext) -> TradeoffStudy:
    """Factory of the study `estimators`."""
    return TradeoffStudy(options, context, "estimate")
