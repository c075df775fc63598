"""Study `models`: scores of finished models on the objects of a dataset that they were not trained on.

Only the one-parameter baselines are fitted, on the other objects of the dataset if it
has any, else out of fold.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from lsds_plugins.models import model_path

from lsds.contracts import BuildContext
from lsds.contracts.learning import Job
from lsds.contracts.study import StudyResult, Value
from lsds.errors import DataError
from lsds.models.artefact import Artefact
from lsds.models.artefact import load as load_model
from lsds.registry.backends import did_you_mean
from lsds.registry.host import PluginHost
from lsds_research.datasets import Dataset, load
from lsds_research.evaluation import detection, severity
from lsds_research.evaluation.fitting import labelled, task
from lsds_research.make_models import SHIPPED
from lsds_research.studies.models.scored_plot import plot

if TYPE_CHECKING:
    from lsds_research.studies.models.options import ModelsOptions

_SHIPPED: dict[Job, tuple[str, ...]] = {"detect": SHIPPED["detection"], "estimate": SHIPPED["severity"]}
_COLUMNS: dict[Job, tuple[tuple[str, str, str, float], ...]] = {
    "detect": (
        ("accuracy", "accuracy", ".3f", 1.0),
        ("accuracy_low", "low", ".3f", 1.0),
        ("accuracy_high", "high", ".3f", 1.0),
        ("accuracy_all", "all frames", ".3f", 1.0),
        ("false_positive_rate", "false positives", ".3f", 1.0),
        ("auc", "AUC", ".3f", 1.0),
        ("onset_latency_s", "onset, s", ".3f", 1.0),
        ("onsets_missed", "missed", ".3f", 1.0),
        ("false_alarms_per_min", "alarms a min", ".1f", 1.0),
        ("answered", "answered", ".3f", 1.0),
    ),
    "estimate": (
        ("mae_cm_s", "MAE, cm/s", ".2f", 100.0),
        ("mae_low_cm_s", "low", ".2f", 100.0),
        ("mae_high_cm_s", "high", ".2f", 100.0),
        ("moving_mae_cm_s", "moving", ".2f", 100.0),
        ("r2", "R2", ".2f", 1.0),
        ("coverage", "covered", ".2f", 1.0),
        ("moving_coverage", "moving", ".2f", 1.0),
        ("angular_relative_error", "angular error", ".2f", 1.0),
        ("angular_coverage", "covered", ".2f", 1.0),
        ("turning_coverage", "turning", ".2f", 1.0),
        ("answered", "answered", ".3f", 1.0),
    ),
}
"""Key, heading, format and display factor of each score, by job."""


class ModelsStudy:
    """A `Study`: scores by model and object."""

    def __init__(self, options: ModelsOptions, context: BuildContext) -> None:
        self.options = options

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Score. Raises DataError without a dataset or an object to score on, ModelError for a model."""
        data = load(Path(self.options.data))
        job = self.options.job or _job_of(data)
        names = self.options.models or _SHIPPED[job]
        models = [load_model(_path(name, job), job) for name in names]
        chosen = np.isin(data["object"], self._objects(data, models))
        test, others = data.where(chosen), data.where(~chosen)
        rows = []
        for done, (name, model) in enumerate(zip(names, models, strict=True), 1):
            rows += _scores(name, model, test, job)
            tick(done, len(models) + 1)
        rows += _plain(others, test, job)
        columns = _COLUMNS[job]
        shown: list[dict[str, Value]] = [
            {"model": row["model"], "object": row["object"]}
            | {key: _times(row.get(key.removesuffix("_cm_s")), times) for key, _, _, times in columns}
            for row in rows
        ]
        what = "slip detection" if job == "detect" else "slip speed"
        known = sorted(_learnt(models) & set(test["object"].tolist()))
        where = "objects, some of the training data" if known else "held-out objects"
        title = f"Models as they are: {what} on {where}, {data.card.get('figures_are', 'unknown')}"
        heads = [
            ("model", "model", ""),
            ("object", "object", ""),
            *((key, head, form) for key, head, form, _ in columns),
        ]
        score = ("accuracy", "accuracy", "accuracy_low", "accuracy_high")
        if job == "estimate":
            score = ("mae_cm_s", "MAE, cm/s", "mae_low_cm_s", "mae_high_cm_s")
        if job == "detect":
            answered = "share of the labelled frames in which all inputs of the model are defined"
            coverage = f"answered: {answered}; scores are of those; in scores of all frames, the others count as rest"
        else:
            coverage = "covered: by the 90 % intervals; of all frames, and of those that move or turn"
        size = f"{len(test)} frames of {len(test.starts) - 1} recordings"
        notes = [f"{size}; low and high: 95 % interval over recordings", coverage]
        return StudyResult(title, heads, shown, partial(plot, rows=shown, score=score, title=title), notes)

    def _objects(self, data: Dataset, models: list[Artefact]) -> list[str]:
        known = sorted(set(data["object"].tolist()))
        for name in self.options.objects:
            if name not in known:
                raise DataError(f"no object '{name}' in {self.options.data}; {did_you_mean(name, known) or known}")
        learnt = _learnt(models)
        found = self.options.objects or [name for name in known if name not in learnt]
        if not found:
            raise DataError(f"{self.options.data}: the models were trained on all its objects; collect other objects")
        return found


def _learnt(models: list[Artefact]) -> set[str]:
    return {name for model in models for name in (model.card.trained_on or {}).get("objects", ())}


def _path(name: str, job: Job) -> Path:
    if name.endswith(".onnx"):
        return Path(name)
    if name not in _SHIPPED[job]:
        hint = did_you_mean(name, _SHIPPED[job]) or f"there are {', '.join(_SHIPPED[job])}"
        raise DataError(f"no model '{name}' is shipped to {job}; {hint} (a file of your own ends in .onnx)")
    return model_path(name, "")


def _times(value: float | None, times: float) -> float | None:
    """Return a score in display units; None for an undefined one, such as the coverage of turning without a turn."""
    return value * times if value is not None and math.isfinite(value) else None


def _job_of(data: Dataset) -> Job:
    return "estimate" if data.card.get("job") in ("severity", "pipe") else "detect"


def _scores(name: str, model: Artefact, test: Dataset, job: Job) -> list[detection.Row]:
    own = task(test, model.card)
    predicted, title = model.run(own.x), Path(name).stem
    if job == "detect":
        return detection.by_object(title, own, predicted, model.card.threshold)
    return severity.by_object(title, own, predicted, model.card.factors)


def _plain(others: Dataset, test: Dataset, job: Job) -> list[detection.Row]:
    """Return the rows of the trivial baselines."""
    if job == "estimate":
        own = labelled(test, job)
        return severity.plain_unseen(labelled(others, job) if len(others) else own, own)
    if len(others):
        return detection.unseen(others, test, [], PluginHost())
    by: Literal["object", "recording"] = "object" if len(set(test["object"].tolist())) > 1 else "recording"
    return [
        {**row, "object": "all"} for row in (detection.one_parameter(test, by), detection.majority(labelled(test, job)))
    ]
