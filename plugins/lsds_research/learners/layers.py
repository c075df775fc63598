"""torch's layers written into a graph."""

from __future__ import annotations

from typing import Any

import numpy as np

from lsds_research.learners.compression import Compression
from lsds_research.learners.graph import Graph
from lsds_research.learners.training import array


def write_sequential(graph: Graph, layers: Any, value: str, compression: Compression | None = None) -> str:
    """Add a Sequential of linear layers, layer normalisations, ReLU and dropout; return the output's name.

    The first layer is linear; its weights include the linear part of `compression`, if given.
    """
    from torch import nn

    for layer in layers:
        if isinstance(layer, nn.Linear):
            affine: tuple[Any, Any] = array(layer.weight).T, array(layer.bias)
            if compression is not None:
                affine = compression.folded(*affine)
                compression = None
            value = graph.dense(value, *affine)
        elif isinstance(layer, nn.LayerNorm):
            scale, bias = graph.constant(array(layer.weight)), graph.constant(array(layer.bias))
            value = graph.add("LayerNormalization", value, scale, bias, axis=-1, epsilon=layer.eps)
        elif isinstance(layer, nn.ReLU):
            value = graph.add("Relu", value)
        elif not isinstance(layer, nn.Dropout):
            raise TypeError(f"{type(layer).__name__} has no counterpart here")
    return value


def write_recurrent(graph: Graph, module: Any, value: str, compression: Compression) -> str:
    """Add an LSTM or a GRU of any depth, batch first; return the last layer's last state, (n, hidden).

    The weights of the first layer include the linear part of the `compression`.

    The order of the gates differs: torch has input, forget, cell, output and reset, update, new; ONNX input,
    output, forget, cell and update, reset, new.
    """
    from torch import nn

    op, order = ("LSTM", (0, 3, 1, 2)) if isinstance(module, nn.LSTM) else ("GRU", (1, 0, 2))
    extra: dict[str, Any] = {} if op == "LSTM" else {"linear_before_reset": 1}
    value = graph.add("Transpose", value, perm=[1, 0, 2])
    for layer in range(module.num_layers):
        names = ("weight_ih", "weight_hh", "bias_ih", "bias_hh")
        values: list[Any] = [array(getattr(module, f"{name}_l{layer}")) for name in names]
        if layer == 0:
            folded, values[2] = compression.folded(values[0].T, values[2])
            values[0] = folded.T
        blocks = [np.split(v, len(order)) for v in values]
        inward, back, *bias = (np.concatenate([parts[gate] for gate in order])[None] for parts in blocks)
        weights = [graph.constant(w) for w in (inward, back, np.concatenate(bias, axis=1))]
        last = layer == module.num_layers - 1
        # All states of a layer for the next, (length, 1, n, hidden); of the last one its last, (1, n, hidden).
        keep: dict[str, Any] = {"outputs": 2, "keep": 1} if last else {}
        states = graph.add(op, value, *weights, hidden_size=module.hidden_size, **keep, **extra)
        value = graph.add("Squeeze", states, graph.constant(np.array([0 if last else 1])))
    return value
