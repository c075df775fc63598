"""A learner by name, fitted on rows of a dataset, and its cross-validated predictions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext
from lsds.contracts.learning import Examples, Fitted, Learner
from lsds.errors import DataError
from lsds.registry.host import PluginHost
from lsds_research.slips.labels import PROTOCOL as LABELLED
from lsds_research.windows import windows

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.models.artefact import Card
    from lsds_research.datasets import Dataset


REAL_WEIGHT = 8.0
"""Weight of a real frame labelled by eye; simulated frames have weight 1."""


@dataclass(frozen=True, slots=True)
class Model:
    """A learner to build: backend name, options, title in tables, and the maximum number of windows to fit on, drawn at
    random; 0 for all. `own`: a study selects it, so it is that of lsds even if a plugin claims its name."""

    learner: str
    options: Mapping[str, Any] = field(default_factory=dict)
    title: str = ""
    most: int = 0
    own: bool = False

    @property
    def name(self) -> str:
        """The title, or the backend's name."""
        return self.title or self.learner

    def build(self, host: PluginHost) -> Learner:
        """Return the learner. Raises PluginError if its libraries are missing, ConfigError for its options."""
        name = host.own("learner", self.learner) if self.own else self.learner
        learner: Learner = host.build("learner", name, dict(self.options), BuildContext(VirtualClock(), 0))
        return learner


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """A dataset as the input of one learner: windows (n, length, F), targets (n,) or (n, 3), and their rows (n,); rows
    with an unknown label are left out."""

    data: Dataset
    x: NDArray[np.float32]
    y: NDArray[np.float32]
    rows: NDArray[np.intp]

    def column(self, name: str) -> NDArray[Any]:
        """Return a column's values (n,) for these windows."""
        values: NDArray[Any] = self.data[name][self.rows]
        return values

    @property
    def answered(self) -> float:
        """Fraction of the labelled frames of these windows' objects that have a window; the others get no
        prediction."""
        return len(self.rows) / max(len(self.rows) + len(self.unanswered), 1)

    @property
    def unanswered(self) -> NDArray[np.intp]:
        """Labelled rows of these windows' objects that have no window."""
        known = _known(targets(self.data, "detect" if self.y.ndim == 1 else "estimate"))
        known &= np.isin(self.data["object"], np.unique(self.column("object")))
        known[self.rows] = False
        return np.flatnonzero(known)

    def part(self, index: NDArray[np.intp] | NDArray[np.bool_]) -> Task:
        """Return the windows `index`, numbers or a mask, as a separate task."""
        return Task(self.data, self.x[index], self.y[index], self.rows[index])

    def examples(self, index: NDArray[np.intp]) -> Examples:
        """Return the windows `index`, grouped by object; by recording if there is only one object."""
        names = self.column("object")[index]
        if len(set(names.tolist())) == 1:
            names = self.column("recording")[index]
        group = np.unique(names, return_inverse=True)[1]
        real = self.column("protocol")[index] == LABELLED
        weight = np.where(real, REAL_WEIGHT, 1.0).astype(np.float32) if real.any() and not real.all() else None
        return Examples(self.x[index], self.y[index], group, weight)


def task(data: Dataset, looks: Learner | Card) -> Task:
    """Return a dataset as the input of a learner, or of the model with that card.

    Raises DataError if no row has a label and all signals.
    """
    x, rows = windows(data, looks.signals, looks.length)
    y = targets(data, looks.job)[rows]
    known = _known(y)
    if not known.any():
        raise DataError(f"no row of the dataset has a label and all of {', '.join(looks.signals)}")
    return Task(data, x[known], y[known], rows[known])


def labelled(data: Dataset, job: str) -> Task:
    """Return all rows that have a label, without signals: the data for scoring baselines."""
    y = targets(data, job)
    rows = np.flatnonzero(_known(y))
    return Task(data, np.zeros((len(rows), 0, 0), np.float32), y[rows], rows)


def targets(data: Dataset, job: str) -> NDArray[np.float32]:
    """Return the targets, (rows,) slip or (rows, 3) velocities; negative or NaN if unknown."""
    if job == "detect":
        return data["slip"].astype(np.float32)
    names = ("velocity_x", "velocity_y", "angular_velocity_label")
    return np.stack([data[name] for name in names], axis=1).astype(np.float32)


def _known(y: NDArray[np.float32]) -> NDArray[np.bool_]:
    return np.asarray(np.isfinite(y).all(axis=1) if y.ndim == 2 else y >= 0)


def fit(learner: Learner, examples: Examples, seed: int, most: int = 0) -> Fitted:
    """Fit, on at most `most` examples if that is not 0. Raises DataError if all labels are equal."""
    if 0 < most < len(examples.y):
        kept = np.sort(np.random.default_rng(seed).choice(len(examples.y), most, replace=False))
        weight = None if examples.weight is None else examples.weight[kept]
        examples = Examples(examples.x[kept], examples.y[kept], examples.group[kept], weight)
    if learner.job == "detect" and len(np.unique(examples.y)) < 2:
        raise DataError(
            "all training rows have the same label; add rows with slip and with rest, for scores also in "
            "each part that remains without some objects"
        )
    return learner.fit(examples, seed)


def out_of_fold(
    learner: Learner, own: Task, folds: Iterable[tuple[NDArray[np.intp], NDArray[np.intp]]], seed: int, most: int = 0
) -> NDArray[np.float32]:
    """Return the prediction for each window by the model not fitted on its fold: (n,) or (n, 8)."""
    answers: NDArray[np.float32] | None = None
    for train, test in folds:
        predicted = fit(learner, own.examples(train), seed, most).predict(own.x[test])
        if answers is None:
            answers = np.full((len(own.rows), *predicted.shape[1:]), np.nan, np.float32)
        answers[test] = predicted
    if answers is None:
        raise DataError("no folds: nothing was fitted")
    return answers
