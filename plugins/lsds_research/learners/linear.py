"""Linear models of a window of compressed signals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from lsds.contracts import BuildContext
from lsds_research.learners.common import LearnerBase, LearnerOptions, hold_out, targets
from lsds_research.learners.compression import Compression
from lsds_research.learners.graph import Graph
from lsds_research.learners.symmetry import Symmetry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts.learning import Examples

    Floats = NDArray[np.float64]


class LogisticOptions(LearnerOptions):
    """Options of the learner `logistic`."""

    length: int = Field(default=4, ge=1, le=100, description="window length, frames")
    inverse_penalty: float = Field(default=1.0, gt=0, le=1e6, description="inverse regularisation, C of scikit-learn")


class LinearWindowOptions(LearnerOptions):
    """Options of the learner `linear-window`."""

    signals: str | list[str] = Field(default="signed-field", description="named set of signals, or their names")
    length: int = Field(default=12, ge=1, le=100, description="window length, frames")
    penalty: float = Field(default=10.0, gt=0, le=1e9, description="regularisation, alpha of scikit-learn's ridge")


class Logistic(LearnerBase):
    """A `Learner`: logistic regression."""

    def __init__(self, options: LogisticOptions, context: BuildContext) -> None:
        super().__init__("detect", options)
        self._options = options

    def fit(self, examples: Examples, seed: int) -> FittedLogistic:
        """Fit; the seed has no effect. Raises DataError for examples that nothing can be learnt from."""
        self.check(examples)
        from sklearn.linear_model import LogisticRegression

        compression = Compression.fit(examples.x)
        model = LogisticRegression(C=self._options.inverse_penalty, max_iter=2000)
        model.fit(_flat(compression, examples.x), examples.y > 0.5)
        return FittedLogistic(model, compression, self.length, len(self.signals))


class FittedLogistic:
    """A fitted logistic regression."""

    def __init__(self, model: object, compression: Compression, length: int, width: int) -> None:
        self._model, self._compression = model, compression
        self._length, self._width = length, width

    def predict(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the probability of slip (n,) by scikit-learn."""
        probability = self._model.predict_proba(_flat(self._compression, x))[:, 1]  # type: ignore[attr-defined]
        return np.asarray(probability, np.float32)

    def export(self) -> bytes:
        """Return the ONNX model."""
        model: object = self._model
        graph = Graph(self._length, self._width)
        flat = graph.add("Flatten", self._compression.write(graph))
        weight, bias = self._compression.folded(model.coef_.T, model.intercept_)  # type: ignore[attr-defined]
        return graph.finish(graph.add("Sigmoid", graph.dense(flat, weight, bias)))


class LinearWindow(LearnerBase):
    """A `Learner`: ridge regression on the velocities, and a second one on the logarithm of its errors."""

    def __init__(self, options: LinearWindowOptions, context: BuildContext) -> None:
        super().__init__("estimate", options)
        self._penalty = options.penalty

    def fit(self, examples: Examples, seed: int) -> FittedLinearWindow:
        """Fit. Raises DataError for examples that nothing can be learnt from."""
        self.check(examples)
        symmetry = Symmetry(self.signals)
        compression = symmetry.compression(examples.x, examples.y, seed)
        x, y, held = examples.x, examples.y, hold_out(examples.group, seed)
        if symmetry.known:
            more = symmetry.turned(x, y, np.random.default_rng(seed))
            x, y, held = np.concatenate([x, more[0]]), np.concatenate([y, more[1]]), np.tile(held, 2)
        flat, true = _flat(compression, x), targets(y)
        scale = np.sqrt((true**2).mean(axis=0)) + 1e-9
        # The standard deviations are fitted on data outside the regression's training data.
        value = _Ridge(flat[~held], true[~held] / scale, self._penalty)
        wrong = np.log(np.abs(value(flat[held]) - true[held] / scale) + 1e-3)
        spread = _Ridge(flat[held], wrong, self._penalty)
        predicted = spread(flat[held]).clip(wrong.min(axis=0), wrong.max(axis=0))
        # One factor per output makes the mean square of error over standard deviation one.
        factor = np.sqrt(np.mean((np.exp(wrong) / np.exp(predicted)) ** 2, axis=0))
        value = _Ridge(flat, true / scale, self._penalty)
        limits = np.stack([wrong.min(axis=0), wrong.max(axis=0)])
        return FittedLinearWindow(compression, value, spread, scale, factor, limits, (self.length, len(self.signals)))


class _Ridge:
    """scikit-learn's ridge regression of several outputs."""

    def __init__(self, x: NDArray[np.float32], y: Floats, penalty: float) -> None:
        from sklearn.linear_model import Ridge

        self._model = Ridge(alpha=penalty).fit(x.astype(np.float64), y)
        self.weight: Floats = self._model.coef_.T
        self.bias: Floats = self._model.intercept_

    def __call__(self, x: NDArray[np.float32]) -> Floats:
        return np.asarray(self._model.predict(x.astype(np.float64)))


class FittedLinearWindow:
    """A fitted pair of ridge regressions; negative speeds are set to zero."""

    def __init__(
        self,
        compression: Compression,
        value: _Ridge,
        spread: _Ridge,
        scale: Floats,
        factor: Floats,
        limits: Floats,
        shape: tuple[int, int],
    ) -> None:
        self._compression, self._value, self._spread = compression, value, spread
        self._scale, self._factor, self._limits, self._shape = scale, factor, limits, shape

    def predict(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (n, 8) by scikit-learn: vx, vy, angular velocity, speed, and their standard deviations."""
        flat = _flat(self._compression, x)
        value = self._value(flat) * self._scale
        value[:, 3] = value[:, 3].clip(0.0)
        spread = np.exp(self._spread(flat).clip(*self._limits)) * self._factor * self._scale
        return np.concatenate([value, spread], axis=1).astype(np.float32)

    def export(self) -> bytes:
        """Return the ONNX model."""
        graph = Graph(*self._shape)
        flat = graph.add("Flatten", self._compression.write(graph))
        folded = self._compression.folded
        value = graph.dense(flat, *folded(self._value.weight * self._scale, self._value.bias * self._scale))
        value = graph.add("Max", value, graph.constant(np.array([[-np.inf, -np.inf, -np.inf, 0.0]])))
        spread = graph.dense(flat, *folded(self._spread.weight, self._spread.bias))
        low, high = (graph.constant(limit[None]) for limit in self._limits)
        spread = graph.add("Exp", graph.add("Min", graph.add("Max", spread, low), high))
        spread = graph.add("Mul", spread, graph.constant((self._factor * self._scale)[None]))
        return graph.finish(graph.add("Concat", value, spread, axis=1), (8,))


def _flat(compression: Compression, x: NDArray[np.float32]) -> NDArray[np.float32]:
    return compression(x).reshape(len(x), -1)
