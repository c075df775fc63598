"""Compression of signals for a net: heavy tails, then zero mean and unit spread; part of the exported graph."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds_research.learners.graph import Graph


@dataclass(frozen=True, slots=True, eq=False)
class Compression:
    """asinh(x / unit) * gain + offset, each (F,) float32: linear near zero, logarithmic far out, odd.

    With `tails` false, x / unit * gain + offset, as in the paper's models."""

    per_unit: NDArray[np.float32]
    gain: NDArray[np.float32]
    offset: NDArray[np.float32]
    tails: bool

    @classmethod
    def fit(cls, x: NDArray[np.float32], tails: bool = True) -> Compression:
        """Fit to windows (n, length, F): the unit is the median absolute value of the non-zero signals."""
        last = x[:, -1].astype(np.float64)
        unit = np.ones(last.shape[1])
        for index, values in enumerate(np.abs(last).T if tails else ()):
            sizes = values[values > 0]
            unit[index] = max(float(np.median(sizes)), 1e-12) if len(sizes) else 1.0
        shaped = np.arcsinh(last / unit) if tails else last
        spread = shaped.std(axis=0)
        # A signal that is constant in the training data must not be amplified later.
        gain = np.where(spread > 1e-9 * (1 + np.abs(shaped).max(axis=0)), 1 / np.maximum(spread, 1e-30), 0.0)
        gain = gain.astype(np.float32)
        return cls((1 / unit).astype(np.float32), gain, (-shaped.mean(axis=0) * gain).astype(np.float32), tails)

    def __call__(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return windows (n, length, F) compressed."""
        shaped = np.arcsinh(x * self.per_unit) if self.tails else x
        return np.asarray(shaped * self.gain + self.offset, np.float32)

    def write(self, graph: Graph) -> str:
        """Add the non-linear part to a graph; return the name of its output, (n, length, F).

        `folded` puts gain and offset into the following weights, which saves two operations per frame.
        """
        return graph.add("Asinh", graph.add("Mul", "x", graph.constant(self.per_unit))) if self.tails else "x"

    def folded(
        self, weight: NDArray[np.floating[Any]], bias: NDArray[np.floating[Any]]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return weight (F or length * F, b) and bias (b,) that have the same effect on the output of `write`."""
        repeats = len(weight) // len(self.gain)
        gain, offset = (np.tile(v.astype(np.float64), repeats) for v in (self.gain, self.offset))
        own = weight.astype(np.float64)
        return gain[:, None] * own, bias + offset @ own
