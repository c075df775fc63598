"""Study `learning`: scores against the number of training objects.

A curve that still rises at the end means that more objects would help; a flat one needs other signals, or
another model. Each repeat draws another order of the objects. Scores are always of the same held-out objects and, if
given, of a second dataset.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.contracts import BuildContext
from lsds.contracts.study import StudyResult, Value
from lsds.errors import DataError
from lsds.registry.host import PluginHost
from lsds_research.datasets import Dataset, load
from lsds_research.evaluation import detection, severity
from lsds_research.evaluation.fitting import Model, Task, fit, labelled, task
from lsds_research.studies.models.curve_plot import plot
from lsds_research.studies.models.split_dataset import split_dataset

if TYPE_CHECKING:
    from lsds.contracts.learning import Job, Learner
    from lsds_research.studies.models.options import LearningOptions

OBJECT_COUNTS = (1, 2, 4, 8, 15)
"""Numbers of training objects at which models are scored, up to all fifteen; chosen."""
SCORES: dict[Job, dict[str, tuple[str, float]]] = {
    "detect": {"accuracy": ("accuracy", 1.0), "auc": ("AUC", 1.0), "false_positive_rate": ("false positive rate", 1.0)},
    "estimate": {
        "mae": ("MAE, cm/s", 100.0),
        "moving_mae": ("MAE moving, cm/s", 100.0),
        "r2": ("R2", 1.0),
        "angular_relative_error": ("angular error", 1.0),
    },
}
"""Key, heading and display factor of each score, by job."""


class LearningStudy:
    """A `Study`: scores by the number of training objects."""

    def __init__(self, options: LearningOptions, context: BuildContext) -> None:
        self.options, self._host = options, PluginHost()

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Fit and score. Raises DataError without a dataset with training and held-out objects."""
        options = self.options
        seen, unseen = split_dataset(options.data)
        tests = {"unseen": unseen}
        if options.also:
            other = load(Path(options.also))
            other = other.where(~np.isin(other["object"], seen["object"]))
            if not len(other):
                raise DataError(f"{options.also}: has no object that is not in the training data")
            tests[Path(options.also).name or "also"] = other
        learners = self._learners()
        job = next(iter(learners.values())).job
        counts = sorted({min(count, len(np.unique(seen["object"]))) for count in OBJECT_COUNTS})
        whole = len(learners) * len(counts) * options.repeats
        rows: list[dict[str, Value]] = []
        fits = (
            found for name, learner in learners.items() for found in self._curve(name, learner, seen, tests, counts)
        )
        for done, found in enumerate(fits, 1):
            rows += found
            tick(done, whole)
        rows += _knows_nothing(tests, job)
        shown = SCORES[job]
        columns = [("model", "model", ""), ("objects", "objects", ""), ("windows", "windows", ""), ("on", "on", "")]
        columns += [(key, heading, ".3f") for key, (heading, _) in shown.items()]
        title = f"Scores against number of training objects, {seen.card.get('figures_are', 'of unknown origin')}"
        return StudyResult(
            title,
            columns,
            rows,
            partial(plot, rows=rows, scores=shown, title=title),
            [
                "on: the objects never seen of the dataset, or the other dataset",
                "models are trained on all windows of the given number of objects; 0 objects is the trivial baseline",
            ],
        )

    def _curve(
        self, name: str, learner: Learner, seen: Dataset, tests: dict[str, Dataset], counts: list[int]
    ) -> Iterator[list[dict[str, Value]]]:
        """Yield the rows of one fit after another."""
        scored_on = {on: task(data, learner) for on, data in tests.items()}
        for count, repeat in product(counts, range(self.options.repeats)):
            order = np.random.default_rng([self.options.seed, repeat]).permutation(np.unique(seen["object"]))
            own = task(seen.where(np.isin(seen["object"], order[:count])), learner)
            fitted = fit(learner, own.examples(np.arange(len(own.rows))), self.options.seed)
            common: dict[str, Value] = {"model": name, "objects": count, "windows": len(own.rows), "repeat": repeat}
            yield [
                {**common, "on": on, **_scores(test, fitted.predict(test.x), learner.job)}
                for on, test in scored_on.items()
            ]

    def _learners(self) -> dict[str, Learner]:
        own = "learners" not in self.options.model_fields_set
        found = {name: Model(name, own=own).build(self._host) for name in self.options.learners}
        if len({learner.job for learner in found.values()}) > 1:
            jobs = ", ".join(f"{name} {learner.job}s" for name, learner in found.items())
            raise DataError(f"learners must have one job, not {jobs}")
        return found


def _scores(test: Task, predicted: Any, job: Job) -> dict[str, Value]:
    row = detection.scored(test, predicted) if job == "detect" else severity.scored(test, predicted)
    return {key: None if row[key] is None else row[key] * times for key, (_, times) in SCORES[job].items()}


def _knows_nothing(tests: dict[str, Dataset], job: Job) -> list[dict[str, Value]]:
    """Return the rows of "always zero", or of the most frequent answer."""
    rows: list[dict[str, Value]] = []
    for on, data in tests.items():
        test = labelled(data, job)
        predicted = (
            np.full(len(test.rows), float(np.mean(test.y) > 0.5)) if job == "detect" else np.zeros((len(test.rows), 8))
        )
        name = "majority" if job == "detect" else "always zero"
        rows.append({"model": name, "objects": None, "windows": None, "on": on, **_scores(test, predicted, job)})
    return rows
