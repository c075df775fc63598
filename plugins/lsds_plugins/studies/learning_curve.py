"""Study `learning`: what more objects to learn from would give, measured by giving fewer.

A curve that still rises where the data end asks for more objects; one that is flat asks for other evidence, or for
another model. Objects are drawn in an order of their own by each repeat, and scored are always the same ones, never
seen; where a second dataset is given, that too.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from lsds.contracts import BuildContext
from lsds.contracts.study import StudyResult, Value
from lsds.errors import DataError
from lsds.learning.collect.objects import UNSEEN
from lsds.learning.datasets import Dataset, load
from lsds.learning.evaluation import detection, severity
from lsds.learning.evaluation.fitting import Model, Task, fit, labelled, task
from lsds.plugins.host import PluginHost
from lsds_plugins.studies.learning_plot import plot

if TYPE_CHECKING:
    from lsds.contracts.learning import Job

COUNTS = (1, 2, 4, 8, 15)
SCORES: dict[Job, dict[str, tuple[str, float]]] = {
    "detect": {"accuracy": ("accuracy", 1.0), "auc": ("AUC", 1.0), "false_positive_rate": ("false positive rate", 1.0)},
    "estimate": {
        "mae": ("MAE, cm/s", 100.0), "moving_mae": ("MAE moving, cm/s", 100.0), "r2": ("R2", 1.0),
        "angular_relative_error": ("angular error", 1.0),
    },
}  # fmt: skip
"""By job: score, its heading, and what it is multiplied by to be shown."""


class LearningOptions(BaseModel):
    """Options of the study."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    data: str = Field(default="", description="folder of a dataset: lsds collect, or data/ of lsds reproduce")
    also: str = Field(default="", description="folder of another one, to be scored on besides; nothing is learnt of it")
    learners: list[str] = Field(default=["linear-window", "field-gru"], min_length=1, description="all of one job")
    repeats: int = Field(default=1, ge=1, le=100, description="orders of the objects")
    seed: int = Field(default=0, ge=0)


class LearningStudy:
    """A `Study`: scores by the number of objects to learn from."""

    def __init__(self, options: LearningOptions, context: BuildContext) -> None:
        self.options, self._host = options, PluginHost()

    def run(self, tick: Callable[[int, int], None]) -> StudyResult:
        """Fit and score. Raises DataError where there is no dataset with objects of both kinds."""
        options = self.options
        if not options.data:
            raise DataError("name a dataset with --data: lsds collect makes one, or data/ of lsds reproduce")
        whole = load(Path(options.data))
        unseen = np.isin(whole["object"], UNSEEN)
        if not unseen.any() or unseen.all():
            raise DataError(f"{options.data}: needs objects to learn from and some of {', '.join(UNSEEN)}")
        seen, tests = whole.where(~unseen), {"unseen": whole.where(unseen)}
        if options.also:
            other = load(Path(options.also))
            other = other.where(~np.isin(other["object"], seen["object"]))
            if not len(other):
                raise DataError(f"{options.also}: has no object that nothing is learnt from")
            tests[Path(options.also).name or "also"] = other
        job = self._job()
        names = np.unique(seen["object"])
        counts = sorted({min(count, len(names)) for count in COUNTS})
        todo = [(learner, n, k) for learner in options.learners for n in counts for k in range(options.repeats)]
        rows: list[dict[str, Value]] = []
        for done, (learner, count, repeat) in enumerate(todo, 1):
            order = np.random.default_rng([options.seed, repeat]).permutation(names)
            rows += self._fit(learner, seen.where(np.isin(seen["object"], order[:count])), tests, job, count, repeat)
            tick(done, len(todo))
        rows += _knows_nothing(tests, job)
        shown = SCORES[job]
        columns = [("model", "model", ""), ("objects", "objects", ""), ("windows", "windows", ""), ("on", "on", "")]
        columns += [(key, heading, ".3f") for key, (heading, _) in shown.items()]
        title = f"What more objects to learn from give, {whole.card.get('figures_are', 'of unknown origin')}"
        return StudyResult(title, columns, rows, partial(plot, rows=rows, scores=shown, title=title), [
            "on: the objects never seen of the dataset, or the other dataset",
            "models learn from all windows of so many objects; the row without objects knows nothing",
        ])  # fmt: skip

    def _job(self) -> Job:
        jobs = {name: Model(name).build(self._host).job for name in self.options.learners}
        if len(set(jobs.values())) > 1:
            raise DataError(f"learners of one job, please: {', '.join(f'{name} {job}s' for name, job in jobs.items())}")
        return next(iter(jobs.values()))

    def _fit(
        self, name: str, train: Dataset, tests: dict[str, Dataset], job: Job, count: int, repeat: int
    ) -> list[dict[str, Value]]:
        learner = Model(name).build(self._host)
        own = task(train, learner)
        fitted = fit(learner, own.examples(np.arange(len(own.rows))), self.options.seed)
        told: dict[str, Value] = {"model": name, "objects": count, "windows": len(own.rows), "repeat": repeat}
        found = []
        for on, data in tests.items():
            test = task(data, learner)
            found.append({**told, "on": on, **_scores(test, fitted.predict(test.x), job)})
        return found


def _scores(test: Task, said: Any, job: Job) -> dict[str, Value]:
    row = detection.scored(test, said) if job == "detect" else severity.scored(test, said)
    return {key: None if row[key] is None else row[key] * times for key, (_, times) in SCORES[job].items()}


def _knows_nothing(tests: dict[str, Dataset], job: Job) -> list[dict[str, Value]]:
    """Return the rows of "always zero", or of the most frequent answer."""
    rows: list[dict[str, Value]] = []
    for on, data in tests.items():
        test = labelled(data, job)
        said = (
            np.full(len(test.rows), float(np.mean(test.y) > 0.5)) if job == "detect" else np.zeros((len(test.rows), 8))
        )
        name = "majority" if job == "detect" else "always zero"
        rows.append({"model": name, "objects": None, "windows": None, "on": on, **_scores(test, said, job)})
    return rows
