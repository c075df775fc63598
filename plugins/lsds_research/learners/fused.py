"""Detector `fused`: boosted trees on the motion of imprint and markers in the last frames.

Trees distinguish a fast slip from a load step; a linear model with one weight per signal does not. Histograms of the
signals make training fast on many simulated frames (Ke et al. 2017, scikit-learn's `HistGradientBoostingClassifier`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import Field

from lsds.contracts import BuildContext
from lsds_research.learners.common import LearnerBase, LearnerOptions
from lsds_research.learners.trees import FittedTrees, Grown

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts.learning import Examples


class FusedOptions(LearnerOptions):
    """Options of the learner `fused`."""

    signals: str | list[str] = Field(
        default="imprint-field-and-lost", description="named set of signals, or their names"
    )
    length: int = Field(default=3, ge=1, le=100, description="window length, frames")
    max_depth: int = Field(default=4, ge=1, le=16, description="maximum depth of a tree")
    min_samples_leaf: int = Field(default=20, ge=1, description="minimum examples in a leaf")
    n_estimators: int = Field(default=200, ge=1, le=2000, description="number of trees")
    learning_rate: float = Field(default=0.06, gt=0, le=1, description="learning rate: weight of a tree")


class Fused(LearnerBase):
    """A `Learner`."""

    def __init__(self, options: FusedOptions, context: BuildContext) -> None:
        super().__init__("detect", options)
        self._options = options

    def fit(self, examples: Examples, seed: int) -> FittedFused:
        """Fit. Raises DataError for examples that nothing can be learnt from."""
        self.check(examples)
        from sklearn.ensemble import HistGradientBoostingClassifier

        own = self._options
        model = HistGradientBoostingClassifier(
            max_depth=own.max_depth,
            max_iter=own.n_estimators,
            min_samples_leaf=own.min_samples_leaf,
            learning_rate=own.learning_rate,
            early_stopping=False,  # pyright: ignore[reportArgumentType]
            random_state=seed,
        ).fit(examples.x.reshape(len(examples.x), -1), examples.y > 0.5, sample_weight=examples.weight)
        return FittedFused(model, self.length, len(self.signals), boosted=True)


class _Tree(NamedTuple):
    """A tree in the attributes of scikit-learn's other ensembles."""

    feature: NDArray[np.intp]
    threshold: NDArray[np.float64]
    children_left: NDArray[np.intp]
    children_right: NDArray[np.intp]


class FittedFused(FittedTrees):
    """Fitted trees of scikit-learn's histogram boosting, which store their nodes differently."""

    def _grown(self) -> Grown:
        nodes = [predictor.nodes for (predictor,) in self._model._predictors]
        start = float(self._model._baseline_prediction.item())
        return Grown([_tree(each) for each in nodes], [each["value"] for each in nodes], start)


def _tree(nodes: NDArray[Any]) -> _Tree:
    leaf = nodes["is_leaf"].astype(bool)
    left, right = (np.where(leaf, -1, nodes[side].astype(np.intp)) for side in ("left", "right"))
    return _Tree(nodes["feature_idx"].astype(np.intp), nodes["num_threshold"], left, right)
