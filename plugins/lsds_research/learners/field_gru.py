"""Estimator `field-gru`: two small nets on a window of field signals, with standard deviations.

One net is recurrent; the other processes four frames at a time. Their errors differ, and their mean is better than
either.

Most frames do not slip, so each value is a moving share, 0 to 1, times the value if it moves, which allows an estimate
of exactly zero. The loss is the likelihood of a Laplace distribution, whose centre is the median, plus a share of
squared error, which raises estimates of fast frames. Moving frames have a larger weight, because underestimating a slip
costs more than a false one. The width of the distribution is also learned.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from lsds.contracts import BuildContext
from lsds_research.learners.common import LearnerBase, targets
from lsds_research.learners.compression import Compression
from lsds_research.learners.graph import Graph
from lsds_research.learners.layers import write_recurrent, write_sequential
from lsds_research.learners.symmetry import Symmetry
from lsds_research.learners.training import NetOptions, array, predicted, seeded, train_whole

if TYPE_CHECKING:
    import torch
    from numpy.typing import NDArray

    from lsds.contracts.learning import Examples

WIDTH_FLOOR = 0.02
"""Minimum width of the distribution, in units of the RMS of the moving targets."""
MOVING = (1e-3, 1e-3, 1e-2, 1e-3)
"""Targets smaller than these (m/s, rad/s) are ignored in the choice of the unit."""
SLIDING_THRESHOLD = 0.04
"""Threshold of sliding, in units of speed."""
TURNING_THRESHOLD = 0.05
"""Threshold of turning, in units of angular velocity."""
NUMBERS = 10
"""Number of outputs of a net: four values, four widths, two moving shares."""
SHARE_OF_VALUE = [8, 8, 9, 8]
"""Output that holds the moving share of each value: rotation has its own."""
_WHOLE = 40.0
"""Logit of values without a moving share; its sigmoid is one in float32."""
FRAMES_PER_BLOCK = 4
"""Number of frames in a block."""
TURNED = 0.5
"""Share of the examples that are rotated and mirrored, drawn again in each epoch."""


class FieldGruOptions(NetOptions):
    """Options of the learner `field-gru`."""

    signals: str | list[str] = Field(default="timed-field", description="named set of signals, or their names")
    length: int = Field(default=16, ge=1, le=100, description="window length, frames")
    learning_rate: float = Field(default=3e-3, gt=0, le=1, description="learning rate of Adam")
    weight_decay: float = Field(default=0.01, ge=0, le=10, description="decoupled weight decay of Adam")
    hidden: int = Field(default=32, ge=1, le=1024, description="units of the recurrent layer")
    second: int = Field(default=24, ge=1, le=1024, description="units of the layer after the recurrent one")
    block: int = Field(
        default=48, ge=1, le=1024, description="units of the block net, which processes four frames at a time"
    )
    block_dropout: float = Field(default=0.3, ge=0, lt=1, description="dropout rate of the block net")
    epochs: int = Field(default=40, ge=1, le=10000, description="number of epochs")
    moving_weight: float = Field(default=3.0, ge=1, le=100, description="weight of a frame with slip")
    turning_weight: float = Field(default=4.0, ge=1, le=100, description="weight of the angular velocity in rotation")
    square: float = Field(default=0.3, ge=0, le=100, description="weight of the squared error in the loss")


class FieldGru(LearnerBase):
    """A `Learner`: a recurrent net and one of blocks, Laplace likelihood."""

    def __init__(self, options: FieldGruOptions, context: BuildContext) -> None:
        super().__init__("estimate", options)
        self._options = options

    def fit(self, examples: Examples, seed: int) -> FittedGru:
        """Fit. Raises DataError for examples that nothing can be learnt from."""
        self.check(examples)
        options = self._options
        symmetry = Symmetry(self.signals)
        compression = symmetry.compression(examples.x, examples.y, seed)
        true = targets(examples.y)
        unit = np.array([_rms_moving(column, least) for column, least in zip(true.T, MOVING, strict=True)])
        # One unit for both components of a velocity, independent of the direction of sliding in the data.
        unit[:2] = unit[:2].max()

        def draw(rng: np.random.Generator) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
            x, y = examples.x, examples.y
            if symmetry.known:
                x, y = symmetry.turned(x, y, rng, TURNED)
            return compression(x), (targets(y) / unit).astype(np.float32)

        shape = (self.length, len(self.signals))
        nets = []
        with seeded(seed):
            for make in (_recurrent, _in_blocks):
                nets.append(make(*shape, options))
                train_whole(nets[-1], partial(_loss, options=options), draw, options, seed)
        return FittedGru(nets, compression, unit.astype(np.float32), shape)


class ImprintGruOptions(FieldGruOptions):
    """Options of the learner `imprint-gru`."""

    signals: str | list[str] = Field(
        default="timed-field-and-imprint", description="named set of signals, or their names"
    )


class ImprintGru(FieldGru):
    """A `Learner`: the same nets, with the motion of the imprint as further input."""


def _rms_moving(values: NDArray[np.float64], least: float) -> float:
    moving = values[np.abs(values) > least]
    return math.sqrt(float((moving**2).mean())) if len(moving) else least


def _recurrent(length: int, width: int, options: FieldGruOptions) -> Any:
    from torch import nn

    class Recurrent(nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.body = nn.GRU(width, options.hidden, batch_first=True)
            self.head = nn.Sequential(
                nn.Linear(options.hidden, options.second),
                nn.ReLU(),
                nn.Dropout(options.dropout),
                nn.Linear(options.second, NUMBERS),
            )

        def forward(self, x: torch.Tensor) -> torch.Tensor:
            return _answer(self.head(self.body(x)[0][:, -1]))

    return Recurrent()


def _in_blocks(length: int, width: int, options: FieldGruOptions) -> Any:
    from torch import nn

    size = math.gcd(length, FRAMES_PER_BLOCK)
    count, units = length // size, options.block

    class InBlocks(nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.body = nn.Sequential(nn.Linear(size * width, units), nn.ReLU(), nn.Dropout(options.block_dropout))
            self.head = nn.Sequential(
                nn.Linear(count * units, 2 * units),
                nn.ReLU(),
                nn.Dropout(options.block_dropout),
                nn.Linear(2 * units, NUMBERS),
            )

        def forward(self, x: torch.Tensor) -> torch.Tensor:
            return _answer(self.head(self.body(x.reshape(len(x) * count, size * width)).reshape(len(x), count * units)))

    return InBlocks()


def _answer(raw: torch.Tensor) -> torch.Tensor:
    """Return value and width, (n, 8), of a net's `NUMBERS`."""
    import torch

    softplus = torch.nn.functional.softplus
    value = torch.cat([raw[:, :3], softplus(raw[:, 3:4])], dim=1) * torch.sigmoid(raw[:, SHARE_OF_VALUE])
    return torch.cat([value, WIDTH_FLOOR + softplus(raw[:, 4:8])], dim=1)


def _loss(output: torch.Tensor, wanted: torch.Tensor, options: FieldGruOptions) -> torch.Tensor:
    import torch

    off, width = (output[:, :4] - wanted).abs(), output[:, 4:]
    each = off / width + width.log() + options.square * off**2
    weight = (1 + (options.moving_weight - 1) * (wanted[:, 3:] > SLIDING_THRESHOLD)).expand(-1, 4)
    turns = 1 + (options.turning_weight - 1) * (wanted[:, 2:3].abs() > TURNING_THRESHOLD)
    weight = torch.cat([weight[:, :2], weight[:, 2:3] * turns, weight[:, 3:]], dim=1)
    return (each * weight).mean() / weight.mean()


class FittedGru:
    """Fitted nets; `unit` (4,) is the unit of their targets."""

    def __init__(
        self, nets: list[Any], compression: Compression, unit: NDArray[np.float32], shape: tuple[int, int]
    ) -> None:
        self._nets, self._compression, self._shape = nets, compression, shape
        # A Laplace distribution's standard deviation is the square root of two times its width.
        self._unit = np.concatenate([unit, unit * np.float32(math.sqrt(2))])

    def predict(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return (n, 8) by torch: vx, vy, angular velocity, speed, and their standard deviations."""
        shaped = self._compression(x)
        return np.asarray(np.mean([predicted(net, shaped) for net in self._nets], axis=0) * self._unit)

    def export(self) -> bytes:
        """Return the ONNX model.

        The common part of both nets runs once, on their stacked outputs, because each node of such a small graph costs
        more than its arithmetic."""
        graph = Graph(*self._shape)
        shaped = self._compression.write(graph)
        both = graph.add("Concat", *(self._raw(graph, net, shaped) for net in self._nets), axis=0)
        value, positive, share = graph.split(both, (3, 5, 8))
        value = graph.add("Concat", value, graph.add("Softplus", positive), axis=1)
        value = graph.add("Mul", value, graph.add("Sigmoid", share))
        value = graph.add("Reshape", value, graph.constant(np.array([len(self._nets), -1, 8])))
        total = graph.add("ReduceSum", value, graph.constant(np.array([0])), keepdims=0)
        least = np.repeat(np.array([0, WIDTH_FLOOR], np.float32), 4)
        return graph.finish(graph.dense(total, np.diag(self._unit) / len(self._nets), least * self._unit), (8,))

    def _raw(self, graph: Graph, net: Any, shaped: str) -> str:
        """Add a net up to its last layer; return (n, 16): its values, widths, and a share for each."""
        from torch import nn

        if isinstance(net.body, nn.GRU):
            inner = write_recurrent(graph, net.body, shaped, self._compression)
        else:
            first, last = net.body[0].in_features, net.head[0].in_features
            rows = graph.add("Reshape", shaped, graph.constant(np.array([-1, first])))
            inner = write_sequential(graph, net.body, rows, self._compression)
            inner = graph.add("Reshape", inner, graph.constant(np.array([-1, last])))
        inner = write_sequential(graph, net.head[:-1], inner)
        weight, bias = array(net.head[-1].weight), array(net.head[-1].bias)
        weight = np.concatenate([weight[:8], weight[SHARE_OF_VALUE], np.zeros_like(weight[:4])])
        return graph.dense(inner, weight.T, np.concatenate([bias[:8], bias[SHARE_OF_VALUE], np.full(4, _WHOLE)]))
