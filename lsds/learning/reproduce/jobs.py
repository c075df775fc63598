"""What has to be fitted for each table, as small jobs that run in any process: each returns rows of scores."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from lsds.learning.collect.objects import UNSEEN
from lsds.learning.datasets import Dataset, load
from lsds.learning.evaluation import detection, severity
from lsds.learning.evaluation.fitting import Model
from lsds.plugins.host import PluginHost

Table = Literal["cross-validation", "unseen", "leave-one-out", "severity-unseen", "pipe"]
SETS = ("baseline", "proposed", "combined")
PAPER_DETECTORS = ("random-forest", "gradient-boosting")
OWN_DETECTORS = ("logistic", "field-mlp")
PAPER_ESTIMATORS = ("lstm", "mlp")
OWN_ESTIMATORS = ("linear-window", "field-gru")
MOST = {"gradient-boosting": 12_000, "lstm": 12_000, "field-gru": 12_000}
"""Windows that the slow ones are fitted on at most, so that all of it takes half an hour; the shipped ones had all."""
QUICK_SHARE = 6
"""A quick run fits them on so many times fewer."""


@dataclass(frozen=True, slots=True)
class FitJob:
    """One learner for one table. `split` and `labels` as in `lsds.learning.evaluation`; `kind` "rules" are those that
    learn nothing or one number; `control` "nuisance" looks at nuisances only."""

    table: Table
    learner: str = ""
    signals: str = ""
    split: str = ""
    labels: str = "measured"
    control: str = ""

    def model(self, *, quick: bool) -> Model:
        """The model it fits."""
        chosen = {"signals": self.signals} if self.signals else {}
        # What is shipped is scored on unseen objects as it is shipped: fitted on everything.
        whole = self.table == "severity-unseen" and not quick
        return Model(self.learner, chosen, most=0 if whole else most(quick=quick).get(self.learner, 0))


def most(*, quick: bool) -> dict[str, int]:
    """Return on how many windows learners are fitted at most; those that are not in it have all."""
    return {name: count // QUICK_SHARE for name, count in MOST.items()} if quick else MOST


def planned(*, quick: bool) -> list[FitJob]:
    """Return all jobs, longest first."""
    sets = SETS[2:] if quick else SETS
    found: list[FitJob] = []
    for learner in PAPER_ESTIMATORS:
        found += [FitJob("leave-one-out", learner, signals) for signals in sets]
    found += [FitJob("leave-one-out", learner) for learner in OWN_ESTIMATORS]
    for learner in PAPER_DETECTORS:
        for signals in sets:
            found += [FitJob("cross-validation", learner, signals, split) for split in ("frames", "object")]
        found.append(FitJob("cross-validation", learner, "combined", "recording"))
    for learner in OWN_DETECTORS:
        found += [FitJob("cross-validation", learner, "", split) for split in ("frames", "recording", "object")]
    found += [
        FitJob("cross-validation", "random-forest", "combined", "frames", labels="shuffled"),
        FitJob("cross-validation", "random-forest", "combined", "object", labels="shuffled"),
        FitJob("cross-validation", "field-mlp", "", "object", labels="shuffled"),
        FitJob("cross-validation", "random-forest", "", "object", control="nuisance"),
        FitJob("cross-validation", "logistic", "", "object", control="nuisance"),
        FitJob("leave-one-out", OWN_ESTIMATORS[1], labels="shuffled"),
    ]
    for learner in (*PAPER_DETECTORS, *OWN_DETECTORS):
        found.append(FitJob("unseen", learner, "combined" if learner in PAPER_DETECTORS else ""))
    for learner in (*PAPER_ESTIMATORS, *OWN_ESTIMATORS):
        signals = "combined" if learner in PAPER_ESTIMATORS else ""
        found += [FitJob("severity-unseen", learner, signals), FitJob("pipe", learner, signals)]
    tables: tuple[Table, ...] = ("cross-validation", "unseen", "leave-one-out", "severity-unseen", "pipe")
    return found + [FitJob(table, control="rules") for table in tables]


def run(job: FitJob, folder: str, seed: int, quick: bool) -> list[dict[str, Any]]:
    """Fit and score; return rows, each with the job's table, learner, set, split and labels."""
    rows = _run(job, Path(folder), seed, quick)
    told = {
        "table": job.table, "learner": job.learner, "signals": job.signals or "own", "control": job.control,
        "split": job.split, "labels": job.labels,
    }  # fmt: skip
    return [{**told, **row} for row in rows]


def _run(job: FitJob, folder: Path, seed: int, quick: bool) -> list[dict[str, Any]]:
    host = PluginHost()
    fits = job.model(quick=quick)
    if job.table in ("cross-validation", "unseen"):
        whole = _data(folder / "detection")
        seen, other = _parts(whole)
        if job.control == "rules":
            if job.table == "unseen":
                return detection.unseen(seen, other, [], host, seed)
            rules = [detection.one_parameter(seen, split, seed) for split in ("frames", "recording", "object")]
            return [*rules, detection.majority(seen)]
        if job.table == "unseen":
            return [row for row in detection.unseen(seen, other, [fits], host, seed) if _is(row, job)]
        model = detection.nuisance(fits) if job.control == "nuisance" else fits
        return [detection.cross_validate(seen, model, host, job.split, seed, labels=job.labels)]  # type: ignore[arg-type]
    seen, other = _parts(_data(folder / "severity"))
    if job.table == "leave-one-out":
        if job.control == "rules":
            return severity.baselines(seen, seen)
        groups = 3 if quick or job.labels == "shuffled" else 0
        return [severity.leave_objects_out(seen, fits, host, seed, labels=job.labels, groups=groups)]
    target = other if job.table == "severity-unseen" else _data(folder / "pipe")
    models = [] if job.control == "rules" else [fits]
    rows = severity.unseen(seen, target, models, host, seed)
    return rows if not models else [row for row in rows if _is(row, job)]


def _is(row: dict[str, Any], job: FitJob) -> bool:
    return bool(row["model"] == job.learner)


def _parts(whole: Dataset) -> tuple[Dataset, Dataset]:
    unseen = np.isin(whole["object"], UNSEEN)
    return whole.where(~unseen), whole.where(unseen)


@lru_cache(maxsize=4)
def _data(folder: Path) -> Dataset:
    return load(folder)
