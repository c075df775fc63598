"""Forests over what a whole clip comes to: few recordings, many figures, so the trees choose their cuts at random.

The settings were fixed beforehand and are those for few examples: many trees, leaves of two, labels weighted alike.
None is searched for, as a search over a hundred recordings finds luck.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.learning.incipient_folds import Fit, Predict

    Floats = NDArray[np.float64]


def clip_forest(trees: int = 300, leaf: int = 2, jobs: int = 1) -> Fit:
    """Return a fit: extremely randomised trees. Figures that are undefined take the median of the training rows."""

    def fit(x: Floats, slip: NDArray[np.intp], seed: int) -> Predict:
        from sklearn.ensemble import ExtraTreesClassifier

        middle = medians(x)
        model = ExtraTreesClassifier(
            trees, min_samples_leaf=leaf, max_features="sqrt", class_weight="balanced", random_state=seed, n_jobs=jobs
        )
        model.fit(filled(x, middle), slip)
        return _predict(model, middle)

    return fit


def _predict(model: Any, middle: Floats) -> Predict:
    at = int(np.flatnonzero(model.classes_ == 1)[0])

    def predict(rows: Floats) -> Floats:
        said: Floats = model.predict_proba(filled(rows, middle))[:, at]
        return said

    return predict


def medians(x: Floats) -> Floats:
    """Return (F,) the median of each column's defined values, 0 where it has none."""
    seen = np.isfinite(x)
    return np.array([np.median(column[ok]) if ok.any() else 0.0 for column, ok in zip(x.T, seen.T, strict=True)])


def filled(x: Floats, values: Floats) -> Floats:
    """Return x (n, F) with what is undefined replaced by its column's value."""
    return np.where(np.isfinite(x), x, values)
