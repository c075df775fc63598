"""A model of slip from statistics of a whole clip: the mean of two simple models, because recordings are few.

One model is an ensemble of trees with random thresholds, the other a strongly regularised logistic regression on
logarithms. Of four kinds of model tried on the public recordings, these two have different errors. Their settings are
usual for few examples. They were not tuned, because a search over a hundred recordings fits noise.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lsds_research.clips.features import logged
from lsds_research.learners.graph import Graph
from lsds_research.learners.trees import ensemble

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_research.incipient.folds import Fit, Predict

    Floats = NDArray[np.float64]


def clip_model(trees: int = 300, leaf: int = 2, jobs: int = 1) -> Fit:
    """Return a fit. Undefined figures are replaced by the median of the training rows."""

    def fit(x: Floats, slip: NDArray[np.intp], seed: int) -> Predict:
        middle = medians(x)
        model = _fitted(logged(x, middle), slip, seed, trees, leaf, jobs)
        at = int(np.flatnonzero(model.classes_ == 1)[0])

        def predict(rows: Floats) -> Floats:
            probability: Floats = model.predict_proba(logged(rows, middle))[:, at]
            return probability

        return predict

    return fit


def exported(x: Floats, slip: NDArray[np.intp], seed: int, trees: int = 300, leaf: int = 2) -> tuple[bytes, Floats]:
    """Return the same model as ONNX (`x` float32 (n, 1, F), logarithms; `y` (n,)), and the medians that it needs."""
    middle = medians(x)
    forest, line = _fitted(logged(x, middle), slip, seed, trees, leaf, 1).estimators_
    grown = [tree.tree_ for tree in forest.estimators_]
    leaves = [tree.value[:, 0, 1] / tree.value[:, 0].sum(axis=1) / len(grown) for tree in grown]
    scale, logistic = line[0], line[1]
    weight = logistic.coef_[0] / scale.scale_
    bias = logistic.intercept_ - scale.mean_ @ weight
    graph = Graph(1, x.shape[1])
    flat = graph.add("Reshape", "x", graph.constant(np.array([-1, x.shape[1]])))
    straight = graph.add("Sigmoid", graph.dense(flat, weight[:, None], bias))
    both = graph.add("Add", ensemble(graph, flat, grown, leaves), straight)
    return graph.finish(graph.add("Mul", both, graph.constant(np.array([0.5])))), middle


def _fitted(x: Floats, slip: NDArray[np.intp], seed: int, trees: int, leaf: int, jobs: int) -> Any:
    from sklearn.ensemble import ExtraTreesClassifier, VotingClassifier
    from sklearn.linear_model import LogisticRegression
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    forest = ExtraTreesClassifier(
        trees, min_samples_leaf=leaf, max_features="sqrt", class_weight="balanced", random_state=seed, n_jobs=jobs
    )
    line = make_pipeline(StandardScaler(), LogisticRegression(C=0.01, class_weight="balanced", max_iter=3000))
    return VotingClassifier([("trees", forest), ("line", line)], voting="soft", flatten_transform=False).fit(x, slip)


def medians(x: Floats) -> Floats:
    """Return (F,) the median of each column's defined values, 0 without one."""
    seen = np.isfinite(x)
    return np.array([np.median(column[ok]) if ok.any() else 0.0 for column, ok in zip(x.T, seen.T, strict=True)])
