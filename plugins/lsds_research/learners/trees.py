"""Forest and boosted trees with the paper's settings, exported as one tree ensemble.

scikit-learn compares a float32 signal with a float64 threshold. The exported threshold is the largest float32 not
above it, so that every float32 signal goes the same way in both; only the sum over the trees is rounded otherwise.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from pydantic import Field

from lsds.contracts import BuildContext
from lsds_research.learners.common import LearnerBase, LearnerOptions
from lsds_research.learners.graph import Graph

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts.learning import Examples


class RandomForestOptions(LearnerOptions):
    """Options of the learner `random-forest`: the paper's."""

    signals: str | list[str] = Field(default="combined", description="named set of signals, or their names")
    max_depth: int = Field(default=20, ge=1, le=64, description="maximum depth of a tree")
    max_features: int = Field(default=3, ge=1, le=1000, description="signals considered per split")
    min_samples_leaf: int = Field(default=5, ge=1, description="minimum examples in a leaf")
    min_samples_split: int = Field(default=10, ge=2, description="minimum examples in a node to split it")
    n_estimators: int = Field(default=40, ge=1, le=1000, description="number of trees")


class GradientBoostingOptions(LearnerOptions):
    """Options of the learner `gradient-boosting`: the paper's."""

    signals: str | list[str] = Field(default="combined", description="named set of signals, or their names")
    max_depth: int = Field(default=9, ge=1, le=64, description="maximum depth of a tree")
    min_samples_split: int = Field(default=450, ge=2, description="minimum examples in a node to split it")
    n_estimators: int = Field(default=115, ge=1, le=1000, description="number of trees")
    learning_rate: float = Field(default=0.1, gt=0, le=1, description="learning rate: weight of a tree")


class RandomForest(LearnerBase):
    """A `Learner`: scikit-learn's RandomForestClassifier."""

    def __init__(self, options: RandomForestOptions, context: BuildContext) -> None:
        super().__init__("detect", options)
        self._options = options

    def fit(self, examples: Examples, seed: int) -> FittedTrees:
        """Fit. Raises DataError for examples that nothing can be learnt from."""
        self.check(examples)
        from sklearn.ensemble import RandomForestClassifier

        own = self._options
        width = self.length * len(self.signals)
        model = RandomForestClassifier(
            n_estimators=own.n_estimators,
            max_depth=own.max_depth,
            max_features=min(own.max_features, width),  # pyright: ignore[reportArgumentType] scikit-learn is untyped
            min_samples_leaf=own.min_samples_leaf,
            min_samples_split=own.min_samples_split,
            bootstrap=True,
            random_state=seed,
            n_jobs=1,
        ).fit(examples.x.reshape(-1, width), examples.y > 0.5, sample_weight=examples.weight)
        return FittedTrees(model, self.length, len(self.signals), boosted=False)


class GradientBoosting(LearnerBase):
    """A `Learner`: scikit-learn's GradientBoostingClassifier."""

    def __init__(self, options: GradientBoostingOptions, context: BuildContext) -> None:
        super().__init__("detect", options)
        self._options = options

    def fit(self, examples: Examples, seed: int) -> FittedTrees:
        """Fit. Raises DataError for examples that nothing can be learnt from."""
        self.check(examples)
        from sklearn.ensemble import GradientBoostingClassifier

        own = self._options
        model = GradientBoostingClassifier(
            n_estimators=own.n_estimators,
            max_depth=own.max_depth,
            min_samples_split=own.min_samples_split,
            learning_rate=own.learning_rate,
            random_state=seed,
        ).fit(examples.x.reshape(len(examples.x), -1), examples.y > 0.5, sample_weight=examples.weight)
        return FittedTrees(model, self.length, len(self.signals), boosted=True)


class Grown(NamedTuple):
    """The trees of an ensemble, what each of their nodes adds, (nodes,), and what is added to all of them."""

    trees: Sequence[Any]
    leaves: Sequence[NDArray[np.float64]]
    start: float = 0.0


class FittedTrees:
    """A fitted ensemble; `boosted` trees add up to a logit, others to a probability."""

    def __init__(self, model: Any, length: int, width: int, boosted: bool) -> None:
        self._model, self._boosted = model, boosted
        self._length, self._width = length, width

    def predict(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the probability of slip (n,) by scikit-learn."""
        probability = self._model.predict_proba(x.reshape(len(x), -1))[:, 1]
        return np.asarray(probability, np.float32)

    def export(self) -> bytes:
        """Return the ONNX model."""
        trees, leaves, start = self._grown()
        graph = Graph(self._length, self._width)
        flat = graph.add("Reshape", "x", graph.constant(np.array([-1, self._length * self._width])))
        total = ensemble(graph, flat, trees, leaves)
        if not self._boosted:
            return graph.finish(total)
        return graph.finish(graph.add("Sigmoid", graph.add("Add", total, graph.constant(np.array([start])))))

    def _grown(self) -> Grown:
        trees = [estimator.tree_ for estimator in np.ravel(self._model.estimators_)]
        if not self._boosted:
            return Grown(trees, [tree.value[:, 0, 1] / tree.value[:, 0].sum(axis=1) / len(trees) for tree in trees])
        share = self._model.init_.class_prior_[1]
        leaves = [tree.value[:, 0, 0] * self._model.learning_rate for tree in trees]
        return Grown(trees, leaves, float(np.log(share / (1 - share))))


def ensemble(graph: Graph, flat: str, trees: Sequence[Any], leaves: Sequence[NDArray[np.float64]]) -> str:
    """Add the sum over the trees of `leaves`, each (nodes,); return its name, (n, 1).

    Tables of the operator: inner nodes of all trees one after the other, and their leaves; a tree that is one leaf
    becomes a node both sides of which are that leaf.
    """
    from onnx import numpy_helper

    feature: list[int] = []
    threshold: list[NDArray[np.float32]] = []
    children: dict[str, Any] = {"nodes_truenodeids": [], "nodes_falsenodeids": []}
    is_leaf: dict[str, Any] = {"nodes_trueleafs": [], "nodes_falseleafs": []}
    weights: list[NDArray[np.float32]] = []
    roots: list[int] = []
    nodes = ends = 0
    for tree, values in zip(trees, leaves, strict=True):
        leaf = tree.children_left < 0
        roots.append(nodes)
        inner = ~leaf
        place = np.where(leaf, ends + np.cumsum(leaf) - 1, nodes + np.cumsum(inner) - 1)
        if leaf[0]:
            left = right = np.zeros(1, np.intp)
            feature.append(0)
            threshold.append(np.zeros(1, np.float32))
        else:
            left, right = tree.children_left[inner], tree.children_right[inner]
            feature += tree.feature[inner].tolist()
            threshold.append(_not_above(tree.threshold[inner]))
        for side, child in (("true", left), ("false", right)):
            children[f"nodes_{side}nodeids"] += place[child].tolist()
            is_leaf[f"nodes_{side}leafs"] += leaf[child].astype(int).tolist()
        weights.append(values[leaf].astype(np.float32))
        nodes, ends = len(feature), ends + int(leaf.sum())
    return graph.add(
        "TreeEnsemble",
        flat,
        domain="ai.onnx.ml",
        n_targets=1,
        aggregate_function=1,
        post_transform=0,
        tree_roots=roots,
        nodes_featureids=feature,
        nodes_splits=numpy_helper.from_array(np.concatenate(threshold)),
        nodes_modes=numpy_helper.from_array(np.zeros(nodes, np.uint8)),
        leaf_targetids=[0] * ends,
        leaf_weights=numpy_helper.from_array(np.concatenate(weights)),
        **children,
        **is_leaf,
    )


def _not_above(threshold: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the largest float32 not above each threshold."""
    rounded = threshold.astype(np.float32)
    return np.where(rounded > threshold, np.nextafter(rounded, np.float32(-np.inf)), rounded)
