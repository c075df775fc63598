"""Estimators with the paper's settings: LSTM and MLP trained on the mean square error.

The paper's nets estimate a speed; these estimate speed, velocity and angular velocity from the same hidden layer. They
do not estimate their uncertainty: the standard deviations are constants, measured on held-out groups. The batch is
larger than the paper's 32, for speed, and training stops early.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from lsds.contracts import BuildContext
from lsds_research.learners.common import LearnerBase, targets
from lsds_research.learners.compression import Compression
from lsds_research.learners.graph import Graph
from lsds_research.learners.layers import write_recurrent, write_sequential
from lsds_research.learners.training import StoppingOptions, predicted, seeded, train

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lsds.contracts.learning import Examples


class PaperNetOptions(StoppingOptions):
    """Options of both."""

    compress: bool = Field(default=False, description="compress the tails of the signals before standardising")


class LstmOptions(PaperNetOptions):
    """Options of the learner `lstm`: the paper's."""

    signals: str | list[str] = Field(default="combined", description="named set of signals, or their names")
    length: int = Field(default=5, ge=1, le=100, description="window length, frames")
    dropout: float = Field(default=0.2, ge=0, lt=1, description="dropout rate")
    batch: int = Field(default=256, ge=1, le=65536, description="batch size, windows (the paper: 32)")
    layers: int = Field(default=3, ge=1, le=8, description="number of layers")
    hidden: int = Field(default=30, ge=1, le=1024, description="units in a layer")


class MlpOptions(PaperNetOptions):
    """Options of the learner `mlp`: the paper's."""

    signals: str | list[str] = Field(default="combined", description="named set of signals, or their names")
    batch: int = Field(default=256, ge=1, le=65536, description="batch size, windows (the paper: 32)")
    first: int = Field(default=64, ge=1, le=1024, description="units of the first layer")
    second: int = Field(default=32, ge=1, le=1024, description="units of the second layer")


class Lstm(LearnerBase):
    """A `Learner`: LSTM."""

    def __init__(self, options: LstmOptions, context: BuildContext) -> None:
        super().__init__("estimate", options)
        self._options = options

    def fit(self, examples: Examples, seed: int) -> FittedSquares:
        """Fit. Raises DataError for examples that nothing can be learnt from."""
        self.check(examples)
        from torch import nn

        own = self._options
        with seeded(seed):
            dropout = own.dropout if own.layers > 1 else 0.0
            body = nn.LSTM(len(self.signals), own.hidden, own.layers, batch_first=True, dropout=dropout)
            return _fitted(body, nn.Sequential(nn.Linear(own.hidden, 4)), examples, own, seed)


class Mlp(LearnerBase):
    """A `Learner`: MLP."""

    def __init__(self, options: MlpOptions, context: BuildContext) -> None:
        super().__init__("estimate", options)
        self._options = options

    def fit(self, examples: Examples, seed: int) -> FittedSquares:
        """Fit. Raises DataError for examples that nothing can be learnt from."""
        self.check(examples)
        from torch import nn

        own = self._options
        with seeded(seed):
            layers: list[nn.Module] = []
            width = self.length * len(self.signals)
            for units in (own.first, own.second):
                layers += [nn.Linear(width, units), nn.LayerNorm(units), nn.ReLU(), nn.Dropout(own.dropout)]
                width = units
            return _fitted(None, nn.Sequential(*layers, nn.Linear(width, 4)), examples, own, seed)


def _fitted(body: Any, head: Any, examples: Examples, options: PaperNetOptions, seed: int) -> FittedSquares:
    import torch
    from torch import nn

    class Net(nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.body, self.head = body, head

        def forward(self, x: torch.Tensor) -> torch.Tensor:
            value = x.flatten(1) if self.body is None else self.body(x)[0][:, -1]
            result: torch.Tensor = self.head(value)
            return result

    compression = Compression.fit(examples.x, tails=options.compress)
    true = targets(examples.y)
    centre, spread = true.mean(axis=0), true.std(axis=0) + 1e-9
    # Both components of a velocity share a unit, so that data along one axis do not make the other one exact.
    spread[:2] = spread[:2].max()
    net, x = Net(), compression(examples.x)
    wanted = ((true - centre) / spread).astype(np.float32)
    held = train(net, nn.functional.mse_loss, x, wanted, examples.group, options, seed)
    fitted = FittedSquares(net, compression, centre, spread, np.zeros(4), (x.shape[1], x.shape[2]))
    wrong = fitted.predict(examples.x[held])[:, :4] - true[held]
    std = np.sqrt((wrong**2).mean(axis=0)) + 1e-9
    std[:2] = std[:2].max()
    return FittedSquares(net, compression, centre, spread, std, fitted.shape)


class FittedSquares:
    """A fitted net of standardised targets; negative speeds are set to zero."""

    def __init__(
        self,
        net: Any,
        compression: Compression,
        centre: NDArray[np.float64],
        spread: NDArray[np.float64],
        std: NDArray[np.float64],
        shape: tuple[int, int],
    ) -> None:
        self._net, self._compression, self.shape = net, compression, shape
        self._centre, self._spread, self._std = (v.astype(np.float32) for v in (centre, spread, std))

    def predict(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (n, 8) by torch: vx, vy, angular velocity, speed, and their standard deviations."""
        value = predicted(self._net, self._compression(x)) * self._spread + self._centre
        value[:, 3] = value[:, 3].clip(0.0)
        return np.concatenate([value, np.broadcast_to(self._std, value.shape)], axis=1)

    def export(self) -> bytes:
        """Return the ONNX model."""
        graph = Graph(*self.shape)
        value = self._compression.write(graph)
        body = self._net.body
        if body is None:
            value = write_sequential(graph, self._net.head, graph.add("Flatten", value), self._compression)
        else:
            value = write_sequential(graph, self._net.head, write_recurrent(graph, body, value, self._compression))
        # Add the constant standard deviations as four more columns: (n, 4) @ (4, 8) + (8,).
        widen = np.concatenate([np.diag(self._spread), np.zeros((4, 4), np.float32)], axis=1)
        value = graph.dense(value, widen, np.concatenate([self._centre, self._std]))
        least = np.full((1, 8), -np.inf)
        least[0, 3] = 0.0
        return graph.finish(graph.add("Max", value, graph.constant(least)), (8,))
