"""Fit on all data, calibrate on held-out objects, and write the model that the running cell loads."""

from __future__ import annotations

import math
import platform
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lsds import __version__
from lsds.models.artefact import Card, save
from lsds.models.intervals import Factors
from lsds_research.evaluation import detection, severity
from lsds_research.evaluation.detection import THRESHOLD
from lsds_research.evaluation.fitting import Model, fit, out_of_fold, task
from lsds_research.splits import folds

if TYPE_CHECKING:
    from lsds.registry.host import PluginHost
    from lsds_research.datasets import Dataset

FOLDS = 5
"""Number of folds of the cross-validation."""
_LIBRARIES = ("numpy", "onnx", "onnxruntime", "scikit-learn", "torch")


def train(
    data: Dataset, model: Model, host: PluginHost, path: Path, seed: int = 0, threshold: float = THRESHOLD
) -> Card:
    """Write `path` (.onnx) and its card; return the card. Its scores and intervals are from held-out objects.

    `threshold` is the probability above which a detector reports slip.

    Raises DataError if the data cannot be fitted, or if a file cannot be written.
    """
    learner = model.build(host)
    own = task(data, learner)
    detects = learner.job == "detect"
    spread = own.y if detects else (severity.true_speed(own) > 1e-3)
    by = "object" if len(set(own.column("object").tolist())) > 1 else "recording"
    names = own.column(by)
    count = min(FOLDS, len(set(names.tolist())))
    parts = list(folds(names, np.asarray(spread, int), count, seed))
    predicted = out_of_fold(learner, own, parts, seed, model.most)
    factors = Factors() if detects else severity.calibration(own, predicted)
    # The baselines are scored on the same windows, also with parameters fitted out of fold.
    if detects:
        scores = detection.scored(own, predicted, threshold)
        rules = [detection.scored(own, *detection.rule_out_of_fold(own, parts)), detection.majority(own)]
        rules[0]["model"] = "one-parameter rule"
    else:
        scores, rules = severity.scored(own, predicted, factors), severity.baselines(own, own)
    fitted = fit(learner, own.examples(np.arange(len(own.rows))), seed, model.most)
    onnx = fitted.export()
    card = Card(
        name=path.stem,
        job=learner.job,
        signals=tuple(learner.signals),
        length=learner.length,
        figures_are=str(data.card.get("figures_are", "unknown")),
        threshold=threshold,
        intervals=factors.rest,
        moving_intervals=factors.moving,
        trained_on=_origin(data, model, seed),
        # The intervals were calibrated on these predictions, so their coverage here is not informative.
        scores={
            "how": f"{count} folds by {by}",
            **_card_scores(scores),
            "beside": {row["model"]: _card_scores(row) for row in rules},
        },
        versions={"lsds": __version__, "python": platform.python_version()} | _versions(),
    )
    save(path, onnx, card)
    return card


def _origin(data: Dataset, model: Model, seed: int) -> dict[str, Any]:
    from_card = {
        key: data.card[key]
        for key in ("job", "seed", "labels", "rig", "overrides", "quick", "datasets")
        if key in data.card
    }
    objects = sorted(set(data["object"].tolist()))
    return {
        **from_card,
        "learner": model.learner,
        "options": dict(model.options),
        "fit_seed": seed,
        "objects": objects,
        "frames": len(data),
        "recordings": len(data.starts) - 1,
    }


def _versions() -> dict[str, str]:
    found = {}
    for name in _LIBRARIES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def _card_scores(scores: Mapping[str, Any]) -> dict[str, Any]:
    """Return the figures for a card; None for an undefined one, such as the precision of a model that never detects
    slip."""
    return {
        key: (round(value, 5) if math.isfinite(value) else None) if isinstance(value, float) else value
        for key, value in scores.items()
        if key not in ("model", "split", "labels") and not key.endswith("coverage")
    }
