"""Observations as the running cell has them, and small models of every learner, saved with their cards."""

from __future__ import annotations

import numpy as np
from research.synthetic import examples
from tactile.scenes import SCALE, make_reference, tracks_of

from lsds.clock import VirtualClock
from lsds.contracts import BuildContext, ContactPatch, Observation
from lsds.models.artefact import Card, save
from lsds.registry import PluginHost
from lsds.tactile.features import FeatureExtractor
from lsds.tactile.field import FieldBuilder

HOST, CONTEXT = PluginHost(), BuildContext(VirtualClock(), 0)
KINDS = {"detect": "detector", "estimate": "estimator"}
#: For what does not ask how good a model is.
LEAST: dict[str, dict[str, int]] = {
    **{key: {"n_estimators": 4} for key in ("random-forest", "gradient-boosting")},
    **{key: {"epochs": 2} for key in ("field-mlp", "lstm", "mlp", "field-gru", "imprint-gru")},
}
MS = 1_000_000


def observations(count: int, seed: int = 0, lose=()) -> list[Observation]:
    """A recording: the gel is sheared more and more, with jitter; most markers are lost in the frames of `lose`."""
    rng = np.random.default_rng(seed)
    reference = make_reference()
    builder, extractor = FieldBuilder(reference, SCALE), FeatureExtractor()
    found, t_ns = [], 0
    displacement = np.zeros((reference.count, 2))
    for index in range(count):
        t_ns += int(rng.integers(38, 43)) * MS
        displacement = displacement + [[1e-6, 1e-5]] + 2e-6 * rng.standard_normal(displacement.shape)
        lost = rng.random(reference.count) < 0.95 if index in lose else None
        field = builder.build(tracks_of(reference, displacement, t_ns, lost, index))
        depth = np.full((30, 40), 1e-4, np.float32)
        contact = ContactPatch(depth, 5e-5, float(rng.uniform(0.3, 0.4)))
        features = extractor.extract(field, contact)
        found.append(Observation(t_ns, index, field.dt_s, field, contact, features))
    return found


def fit_and_save(name: str, folder, **card):
    """Fit a learner a little; return its kind, the model's path and what was fitted."""
    learner = HOST.build("learner", name, LEAST.get(name, {}), CONTEXT)
    fitted = learner.fit(examples(learner.job, learner.signals, learner.length, 400), 0)
    path = folder / f"{name}.onnx"
    save(path, fitted.export(), Card(name, learner.job, learner.signals, learner.length, "simulated", **card))
    return KINDS[learner.job], path, fitted
