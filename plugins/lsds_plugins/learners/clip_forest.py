"""Forests over what a whole clip comes to: few recordings, many figures, so the trees choose their cuts at random.

Of four kinds of model that were tried on the public recordings these trees did best; their settings are those for few
examples (many trees, leaves of two, labels weighted alike) and were not searched for, as a search over a hundred
recordings finds luck.
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
        middle = medians(x)
        model = _fitted(filled(x, middle), slip, seed, trees, leaf, jobs)
        at = int(np.flatnonzero(model.classes_ == 1)[0])

        def predict(rows: Floats) -> Floats:
            said: Floats = model.predict_proba(filled(rows, middle))[:, at]
            return said

        return predict

    return fit


def exported(x: Floats, slip: NDArray[np.intp], seed: int, trees: int = 300, leaf: int = 2) -> tuple[bytes, Floats]:
    """Return the same model as ONNX (`x` float32 (n, F); `probabilities` (n, 2)), and the medians that it needs."""
    from skl2onnx import to_onnx
    from skl2onnx.common.data_types import FloatTensorType

    middle = medians(x)
    model = _fitted(filled(x, middle), slip, seed, trees, leaf, 1)
    shape = [("x", FloatTensorType([None, x.shape[1]]))]
    onnx: bytes = to_onnx(model, initial_types=shape, options={id(model): {"zipmap": False}}).SerializeToString()
    return onnx, middle


def _fitted(x: Floats, slip: NDArray[np.intp], seed: int, trees: int, leaf: int, jobs: int) -> Any:
    from sklearn.ensemble import ExtraTreesClassifier

    model = ExtraTreesClassifier(
        trees, min_samples_leaf=leaf, max_features="sqrt", class_weight="balanced", random_state=seed, n_jobs=jobs
    )
    return model.fit(x, slip)


def medians(x: Floats) -> Floats:
    """Return (F,) the median of each column's defined values, 0 where it has none."""
    seen = np.isfinite(x)
    return np.array([np.median(column[ok]) if ok.any() else 0.0 for column, ok in zip(x.T, seen.T, strict=True)])


def filled(x: Floats, values: Floats) -> Floats:
    """Return x (n, F) with what is undefined replaced by its column's value."""
    return np.where(np.isfinite(x), x, values)
