"""The fits needed for each table, as small jobs that can run in any process; each returns rows of scores."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from lsds.registry.host import PluginHost
from lsds_research.collecting.objects import UNSEEN
from lsds_research.datasets import Dataset, load
from lsds_research.evaluation import detection, severity
from lsds_research.evaluation.controls import nuisance, shuffled
from lsds_research.evaluation.fitting import Model, labelled
from lsds_research.splits import seen_and_unseen

Table = Literal["cross-validation", "unseen", "leave-one-out", "severity-unseen"]
Row = dict[str, Any]
SETS = ("baseline", "proposed", "combined")
PAPER_DETECTORS = ("random-forest", "gradient-boosting")
OWN_DETECTORS = ("logistic", "field-mlp")
PAPER_ESTIMATORS = ("lstm", "mlp")
OWN_ESTIMATORS = ("linear-window", "field-gru")
MOST = {
    "random-forest": 12_000,
    "gradient-boosting": 6_000,
    "logistic": 20_000,
    "field-mlp": 20_000,
    "lstm": 1_500,
    "mlp": 4_000,
    "field-gru": 8_000,
}
"""Maximum number of training windows in each of many fits, which limits the whole to half an hour.

Fits for unseen objects use all windows.
"""
SHUFFLED_MOST = {"field-gru": 3_000}
"""Maximum number of training windows of controls with shuffled labels."""
QUICK_MOST = {"gradient-boosting": 2_000, "lstm": 1_500, "field-gru": 2_000}
"""Maximum number of training windows in a quick run, which has few data."""
GROUPS = 5
"""Number of groups of objects: our own estimators leave out one group instead of one object."""
FEW_GROUPS = 3
"""Number of groups in a quick run and for shuffled labels."""


@dataclass(frozen=True, slots=True)
class FitJob:
    """One learner for one table, "severity-unseen" also for the pipe's. `split` and `labels` as in
    `lsds_research.evaluation`; `control` "rules" are the trivial baselines, "nuisance" uses nuisance signals only."""

    table: Table
    learner: str = ""
    signals: str = ""
    split: str = ""
    labels: str = "measured"
    control: str = ""

    def model(self, *, quick: bool) -> Model:
        """The model it fits."""
        chosen = {"signals": self.signals} if self.signals else {}
        whole = self.table in ("unseen", "severity-unseen") and not quick
        few = most(quick=quick).get(self.learner, 0)
        if self.labels == "shuffled" and few:
            few = min(few, SHUFFLED_MOST.get(self.learner, few))
        return Model(self.learner, chosen, most=0 if whole else few, own=True)


def most(*, quick: bool) -> dict[str, int]:
    """Return the maximum number of training windows by learner; other learners use all windows."""
    return QUICK_MOST if quick else MOST


def planned(*, quick: bool) -> list[FitJob]:
    """Return all jobs, longest first."""
    sets = SETS[2:] if quick else SETS
    found = [
        FitJob("severity-unseen", learner, _signals(learner)) for learner in (*OWN_ESTIMATORS[::-1], *PAPER_ESTIMATORS)
    ]
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
        FitJob("unseen", "field-mlp", labels="shuffled"),
        FitJob("unseen", "logistic", control="nuisance"),
        FitJob("leave-one-out", OWN_ESTIMATORS[0], control="nuisance"),
        FitJob("severity-unseen", OWN_ESTIMATORS[0], labels="shuffled"),
        FitJob("severity-unseen", OWN_ESTIMATORS[0], control="nuisance"),
    ]
    found += [FitJob("unseen", learner, _signals(learner)) for learner in (*PAPER_DETECTORS, *OWN_DETECTORS)]
    tables: tuple[Table, ...] = ("cross-validation", "unseen", "leave-one-out", "severity-unseen")
    return found + [FitJob(table, control="rules") for table in tables]


def _signals(learner: str) -> str:
    return "combined" if learner in (*PAPER_DETECTORS, *PAPER_ESTIMATORS) else ""


def run(job: FitJob, folder: str, seed: int, quick: bool) -> list[Row]:
    """Fit and score; return rows, each with the job's table, learner, set, split and labels."""
    rows = _run(job, Path(folder), seed, quick)
    common = {
        "table": job.table,
        "learner": job.learner,
        "signals": job.signals or "own",
        "control": job.control,
        "split": job.split,
        "labels": job.labels,
    }
    return [{**common, **row} for row in rows]


def _run(job: FitJob, folder: Path, seed: int, quick: bool) -> list[Row]:
    detects = job.table in ("cross-validation", "unseen")
    seen, other = seen_and_unseen(_data(folder / ("detection" if detects else "severity")), UNSEEN)
    if job.control == "rules":
        return _rules(job, seen, other, folder, seed)
    host, model = PluginHost(), job.model(quick=quick)
    if job.control == "nuisance":
        model = nuisance(model)
    if job.table == "cross-validation":
        return [detection.cross_validate(seen, model, host, job.split, seed, labels=job.labels)]  # type: ignore[arg-type]
    if job.table == "leave-one-out":
        groups = GROUPS if job.learner in OWN_ESTIMATORS else 0
        groups = FEW_GROUPS if quick or job.labels == "shuffled" else groups
        return [severity.leave_objects_out(seen, model, host, seed, labels=job.labels, groups=groups)]
    if job.labels == "shuffled":
        seen, model = shuffled(seen, seed), replace(model, title=f"{model.name}, labels shuffled")
    if job.table == "unseen":
        return [row for row in detection.unseen(seen, other, [model], host, seed) if row["model"] == model.name]
    scored = severity.calibrated(seen, model, host, seed).scored
    return [{"table": table, **row} for table, target in _targets(other, folder).items() for row in scored(target)]


def _rules(job: FitJob, seen: Dataset, other: Dataset, folder: Path, seed: int) -> list[Row]:
    """Return the rows of the trivial baselines."""
    if job.table == "cross-validation":
        rules = [detection.one_parameter(seen, split, seed) for split in ("frames", "recording", "object")]
        return [*rules, detection.majority(labelled(seen, "detect"))]
    if job.table == "unseen":
        return detection.unseen(seen, other, [], PluginHost(), seed)
    if job.table == "leave-one-out":
        own = labelled(seen, "estimate")
        return severity.baselines(own, own)
    fitted = labelled(seen, "estimate")
    targets = {table: labelled(target, "estimate") for table, target in _targets(other, folder).items()}
    return [{"table": table, **row} for table, own in targets.items() for row in severity.plain_unseen(fitted, own)]


def _targets(other: Dataset, folder: Path) -> dict[str, Dataset]:
    return {"severity-unseen": other, "pipe": _data(folder / "pipe")}


@lru_cache(maxsize=4)
def _data(folder: Path) -> Dataset:
    return load(folder)
