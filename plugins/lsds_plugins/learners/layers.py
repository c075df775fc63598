"""torch's layers written into a graph."""

from __future__ import annotations

from typing import Any

import numpy as np

from lsds_plugins.learners.graph import Graph
from lsds_plugins.learners.training import array


def write_sequential(graph: Graph, layers: Any, value: str) -> str:
    """Add a Sequential of linear layers, layer normalisations, ReLU and dropout; return what comes out."""
    from torch import nn

    for layer in layers:
        if isinstance(layer, nn.Linear):
            value = graph.dense(value, array(layer.weight).T, array(layer.bias))
        elif isinstance(layer, nn.LayerNorm):
            scale, bias = graph.constant(array(layer.weight)), graph.constant(array(layer.bias))
            value = graph.add("LayerNormalization", value, scale, bias, axis=-1, epsilon=layer.eps)
        elif isinstance(layer, nn.ReLU):
            value = graph.add("Relu", value)
        elif not isinstance(layer, nn.Dropout):
            raise TypeError(f"{type(layer).__name__} has no counterpart here")
    return value


def write_recurrent(graph: Graph, module: Any, value: str) -> str:
    """Add an LSTM or a GRU of any depth, batch first; return the last layer's last state, (n, hidden).

    The gates stand in another order there: torch has input, forget, cell, output and reset, update, new; ONNX input,
    output, forget, cell and update, reset, new.
    """
    from torch import nn

    op, order = ("LSTM", (0, 3, 1, 2)) if isinstance(module, nn.LSTM) else ("GRU", (1, 0, 2))
    extra: dict[str, Any] = {} if op == "LSTM" else {"linear_before_reset": 1}
    value = graph.add("Transpose", value, perm=[1, 0, 2])
    for layer in range(module.num_layers):
        names = ("weight_ih", "weight_hh", "bias_ih", "bias_hh")
        blocks = [np.split(array(getattr(module, f"{name}_l{layer}")), len(order)) for name in names]
        inward, back, *bias = (np.concatenate([parts[gate] for gate in order])[None] for parts in blocks)
        weights = [graph.constant(w) for w in (inward, back, np.concatenate(bias, axis=1))]
        last = layer == module.num_layers - 1
        # All states of a layer for the next, (length, 1, n, hidden); of the last one its last, (1, n, hidden).
        keep: dict[str, Any] = {"outputs": 2, "keep": 1} if last else {}
        states = graph.add(op, value, *weights, hidden_size=module.hidden_size, **keep, **extra)
        value = graph.add("Squeeze", states, graph.constant(np.array([0 if last else 1])))
    return value
