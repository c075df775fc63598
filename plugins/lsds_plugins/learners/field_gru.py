"""Estimator `field-gru`: a small recurrent net on a window of the field's evidence, which knows how sure it is.

Most frames do not slip, so each value is a share, 0 to 1, of moving times the value if it moves: exactly still is
within reach. Trained on the likelihood of a Laplace distribution, whose centre is the median: still where still is
more likely, and no square of a rare fast frame drags it along. Its width is learnt beside it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from lsds.contracts import BuildContext
from lsds_plugins.learners.common import LearnerBase, targets
from lsds_plugins.learners.compression import Compression
from lsds_plugins.learners.graph import Graph
from lsds_plugins.learners.layers import write_recurrent, write_sequential
from lsds_plugins.learners.training import NetOptions, predicted, seeded, train

if TYPE_CHECKING:
    import torch
    from numpy.typing import NDArray

    from lsds.contracts.learning import Examples

FLOOR = 0.02
"""Least width of the distribution, in units of the RMS of the target where it moves."""
MOVING = (1e-3, 1e-3, 1e-2, 1e-3)
"""Smaller targets than these (m/s, rad/s) have no say in their unit."""


class FieldGruOptions(NetOptions):
    """Options of the learner `field-gru`."""

    signals: str | list[str] = Field(default="signed-field", description="a set of signals, or their names")
    length: int = Field(default=8, ge=1, le=100, description="frames in a window")
    learning_rate: float = Field(default=3e-3, gt=0, le=1, description="of Adam")
    weight_decay: float = Field(default=0.01, ge=0, le=10, description="of Adam, decoupled")
    hidden: int = Field(default=32, ge=1, le=1024, description="units of the recurrent layer")
    second: int = Field(default=24, ge=1, le=1024, description="units of the layer after it")


class FieldGru(LearnerBase):
    """A `Learner`: one recurrent layer, Laplace likelihood."""

    def __init__(self, options: FieldGruOptions, context: BuildContext) -> None:
        super().__init__("estimate", options)
        self._options = options

    def fit(self, examples: Examples, seed: int) -> FittedGru:
        """Fit. Raises DataError for examples that nothing can be learnt from."""
        self.check(examples)
        compression = Compression.fit(examples.x)
        true = targets(examples.y)
        unit = np.array([_rms_moving(column, least) for column, least in zip(true.T, MOVING, strict=True)])
        x = compression(examples.x)
        with seeded(seed):
            net = _net(len(self.signals), self._options)
            train(net, _laplace, x, (true / unit).astype(np.float32), examples.group, self._options, seed)
        return FittedGru(net, compression, unit.astype(np.float32), (x.shape[1], x.shape[2]))


def _rms_moving(values: NDArray[np.float64], least: float) -> float:
    moving = values[np.abs(values) > least]
    return math.sqrt(float((moving**2).mean())) if len(moving) else 1.0


def _net(width: int, options: FieldGruOptions) -> Any:
    import torch
    from torch import nn

    class Net(nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.body = nn.GRU(width, options.hidden, batch_first=True)
            self.head = nn.Sequential(
                nn.Linear(options.hidden, options.second), nn.ReLU(), nn.Dropout(options.dropout),
                nn.Linear(options.second, 9),
            )  # fmt: skip

        def forward(self, x: torch.Tensor) -> torch.Tensor:
            raw = self.head(self.body(x)[0][:, -1])
            softplus = nn.functional.softplus
            value = torch.cat([raw[:, 1:4], softplus(raw[:, 4:5])], dim=1) * torch.sigmoid(raw[:, :1])
            return torch.cat([value, FLOOR + softplus(raw[:, 5:])], dim=1)

    return Net()


def _laplace(said: torch.Tensor, wanted: torch.Tensor) -> torch.Tensor:
    width = said[:, 4:]
    return ((said[:, :4] - wanted).abs() / width + width.log()).mean()


class FittedGru:
    """A fitted net; `unit` (4,) is that of its targets."""

    def __init__(self, net: Any, compression: Compression, unit: NDArray[np.float32], shape: tuple[int, int]) -> None:
        self._net, self._compression, self._shape = net, compression, shape
        # A Laplace distribution's standard deviation is the square root of two times its width.
        self._unit = np.concatenate([unit, unit * np.float32(math.sqrt(2))])

    def predict(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (n, 8) by torch: vx, vy, angular velocity, speed, and their standard deviations."""
        return np.asarray(predicted(self._net, self._compression(x)) * self._unit)

    def export(self) -> bytes:
        """Return the ONNX model."""
        graph = Graph(*self._shape)
        raw = write_recurrent(graph, self._net.body, self._compression.write(graph), self._compression)
        raw = write_sequential(graph, self._net.head, raw)
        share = graph.add("Sigmoid", graph.columns(raw, 0, 1))
        speed = graph.add("Softplus", graph.columns(raw, 4, 5))
        value = graph.add("Mul", graph.add("Concat", graph.columns(raw, 1, 4), speed, axis=1), share)
        width = graph.add("Softplus", graph.columns(raw, 5, 9))
        width = graph.add("Add", width, graph.constant(np.array([FLOOR])))
        y = graph.add("Mul", graph.add("Concat", value, width, axis=1), graph.constant(self._unit))
        return graph.finish(y, (8,))
