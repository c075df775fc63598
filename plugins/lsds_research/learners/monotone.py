"""Detector `monotone`: logistic regression on the logarithms of rates, with non-negative weights.

Some relations in the simulation do not hold on real recordings: diverging or converging markers mean pressing in ours,
the opposite in real recordings; a window depends on the duration of events; and trees do not extrapolate beyond the
simulated rates. One relation transfers: a faster and less even motion of the field means more slip. Hence non-negative
weights, single frames and logarithms. On the simulated objects this costs a few hundredths of AUC.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from lsds.contracts import BuildContext
from lsds_research.learners.common import LearnerBase, LearnerOptions
from lsds_research.learners.graph import Graph

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts.learning import Examples

    Floats = NDArray[np.float64]

RATES = (
    "residual_along",
    "residual_across",
    "rigid_speed",
    "mean_speed",
    "v_net",
    "div_mean_rate",
    "area_rate",
    "curl_mean_rate",
    "angular_velocity",
)


class MonotoneOptions(LearnerOptions):
    """Options of the learner `monotone`."""

    signals: str | list[str] = Field(default=list(RATES), description="named set of signals, or their names")
    floor: float = Field(default=1e-5, gt=0, le=1, description="noise floor added before the logarithm")
    penalty: float = Field(default=1e-3, gt=0, le=10, description="L2 penalty of the weights")


class Monotone(LearnerBase):
    """A `Learner`: logistic regression with weights of one sign."""

    def __init__(self, options: MonotoneOptions, context: BuildContext) -> None:
        super().__init__("detect", options)
        self._options = options

    def fit(self, examples: Examples, seed: int) -> FittedMonotone:
        """Fit; the seed has no effect. Raises DataError for examples that cannot be fitted."""
        self.check(examples)
        from scipy.optimize import minimize

        shaped = _shaped(examples.x, self._options.floor)
        centre, spread = shaped.mean(axis=0), shaped.std(axis=0) + 1e-9
        z, y = (shaped - centre) / spread, examples.y.astype(np.float64)
        penalty = self._options.penalty

        def loss(w: Floats) -> tuple[float, Floats]:
            logit = z @ w[:-1] + w[-1]
            wrong = 1 / (1 + np.exp(-logit)) - y
            value = np.logaddexp(0, logit).mean() - (logit * y).mean() + penalty * (w[:-1] ** 2).sum()
            return float(value), np.append(z.T @ wrong / len(y) + 2 * penalty * w[:-1], wrong.mean())

        width = z.shape[1]
        bounds = [(0.0, None)] * width + [(None, None)]
        w = minimize(loss, np.zeros(width + 1), jac=True, method="L-BFGS-B", bounds=bounds).x
        weight = w[:-1] / spread
        return FittedMonotone(
            weight, float(w[-1] - centre @ weight), self._options.floor, self.length, len(self.signals)
        )


class FittedMonotone:
    """Weights on log(|x| + floor), and a constant."""

    def __init__(self, weight: Floats, constant: float, floor: float, length: int, width: int) -> None:
        self.weight, self._constant, self._floor = weight, constant, floor
        self._length, self._width = length, width

    def predict(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the probability of slip (n,)."""
        logit = _shaped(x, self._floor) @ self.weight + self._constant
        return np.asarray(1 / (1 + np.exp(-logit)), np.float32)

    def export(self) -> bytes:
        """Return the ONNX model."""
        graph = Graph(self._length, self._width)
        floor = graph.constant(np.array(self._floor))
        shaped = graph.add("Log", graph.add("Add", graph.add("Abs", "x"), floor))
        flat = graph.add("Flatten", shaped)
        return graph.finish(graph.add("Sigmoid", graph.dense(flat, self.weight[:, None], np.array([self._constant]))))


def _shaped(x: NDArray[np.float32], floor: float) -> Floats:
    return np.log(np.abs(x.reshape(len(x), -1).astype(np.float64)) + floor)
