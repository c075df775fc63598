"""A fitted linear model on the logarithms of signals: what counts is by which factor a signal is larger."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from lsds_research.learners.graph import Graph

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


class FittedLogarithms:
    """Weights on log(|x| + floor), one floor or one a column, and a constant; the sigmoid of their sum."""

    def __init__(self, weight: Floats, constant: float, floor: float | Floats, length: int, width: int) -> None:
        self.weight, self._constant, self._floor = weight, constant, floor
        self._length, self._width = length, width

    def predict(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the probability of slip (n,)."""
        logit = logarithms(x, self._floor) @ self.weight + self._constant
        return np.asarray(1 / (1 + np.exp(-logit)), np.float32)

    def export(self) -> bytes:
        """Return the ONNX model."""
        graph = Graph(self._length, self._width)
        flat = graph.add("Flatten", graph.add("Abs", "x"))
        shaped = graph.add("Log", graph.add("Add", flat, graph.constant(np.array(self._floor))))
        return graph.finish(graph.add("Sigmoid", graph.dense(shaped, self.weight[:, None], np.array([self._constant]))))


def logarithms(x: NDArray[np.float32], floor: float | Floats) -> Floats:
    """Return log(|x| + floor) (n, length * F) of windows (n, length, F)."""
    return np.asarray(np.log(np.abs(x.reshape(len(x), -1).astype(np.float64)) + floor))
