"""Detector `field-mlp`: a small net on a window of field signals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from lsds.contracts import BuildContext
from lsds_research.learners.common import LearnerBase
from lsds_research.learners.compression import Compression
from lsds_research.learners.graph import Graph
from lsds_research.learners.layers import write_sequential
from lsds_research.learners.training import StoppingOptions, predicted, seeded, train

if TYPE_CHECKING:
    import torch
    from numpy.typing import NDArray

    from lsds.contracts.learning import Examples


class FieldMlpOptions(StoppingOptions):
    """Options of the learner `field-mlp`."""

    length: int = Field(default=6, ge=1, le=100, description="window length, frames")
    learning_rate: float = Field(default=2e-3, gt=0, le=1, description="learning rate of Adam")
    weight_decay: float = Field(default=0.02, ge=0, le=10, description="decoupled weight decay of Adam")
    dropout: float = Field(default=0.15, ge=0, lt=1, description="dropout rate")
    first: int = Field(default=48, ge=1, le=1024, description="units of the first layer")
    second: int = Field(default=24, ge=1, le=1024, description="units of the second layer")


class FieldMlp(LearnerBase):
    """A `Learner`: two hidden layers, cross entropy."""

    def __init__(self, options: FieldMlpOptions, context: BuildContext) -> None:
        super().__init__("detect", options)
        self._options = options

    def fit(self, examples: Examples, seed: int) -> FittedMlp:
        """Fit. Raises DataError for examples that nothing can be learnt from."""
        self.check(examples)
        from torch import nn

        own = self._options
        compression = Compression.fit(examples.x)
        x = compression(examples.x)
        with seeded(seed):
            layers: list[nn.Module] = [nn.Flatten()]
            width = x.shape[1] * x.shape[2]
            for units in (own.first, own.second):
                layers += [nn.Linear(width, units), nn.ReLU(), nn.Dropout(own.dropout)]
                width = units
            net = nn.Sequential(*layers, nn.Linear(width, 1))

            def loss(output: torch.Tensor, wanted: torch.Tensor) -> torch.Tensor:
                return nn.functional.binary_cross_entropy_with_logits(output[:, 0], wanted)

            train(net, loss, x, examples.y, examples.group, own, seed)
        return FittedMlp(net, compression, (x.shape[1], x.shape[2]))


class FittedMlp:
    """A fitted net that gives a logit."""

    def __init__(self, net: Any, compression: Compression, shape: tuple[int, int]) -> None:
        self._net, self._compression, self._shape = net, compression, shape

    def predict(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the probability of slip (n,) by torch."""
        import torch

        logit = predicted(self._net, self._compression(x))[:, 0]
        return np.asarray(torch.sigmoid(torch.from_numpy(logit)).numpy())

    def export(self) -> bytes:
        """Return the ONNX model."""
        graph = Graph(*self._shape)
        flat = graph.add("Flatten", self._compression.write(graph))
        return graph.finish(graph.add("Sigmoid", write_sequential(graph, self._net[1:], flat, self._compression)))
