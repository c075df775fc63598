"""Writing ONNX graphs node by node, without tracing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

OPSET = 18
"""Version of the ONNX opset; onnxruntime 1.20 and later run it."""
ML_OPSET = 5
"""Version of the opset `ai.onnx.ml`; onnxruntime 1.20 and later run it."""
IR = 10
"""Version of the ONNX format; onnxruntime 1.20 and later read it."""


class Graph:
    """A graph from windows `x` (n, length, F) to `y`; nodes are added in order and named automatically."""

    def __init__(self, length: int, width: int) -> None:
        self._shape = (length, width)
        self._nodes: list[Any] = []
        self._constants: list[Any] = []

    def constant(self, values: NDArray[Any]) -> str:
        """Add a constant, floats as float32; return its name."""
        from onnx import numpy_helper

        name = f"c{len(self._constants)}"
        kept = values.astype(np.float32) if values.dtype.kind == "f" else values
        self._constants.append(numpy_helper.from_array(np.ascontiguousarray(kept), name))
        return name

    def add(self, op: str, *inputs: str, outputs: int = 1, keep: int = 0, domain: str = "", **attributes: Any) -> str:
        """Add a node; return the name of its output number `keep` of `outputs`, the others are dropped."""
        from onnx import helper

        name = f"n{len(self._nodes)}"
        names = [name if index == keep else "" for index in range(outputs)]
        self._nodes.append(helper.make_node(op, list(inputs), names, domain=domain, **attributes))
        return name

    def dense(self, value: str, weight: NDArray[Any], bias: NDArray[Any]) -> str:
        """Add value (n, a) @ weight (a, b) + bias (b,)."""
        return self.add("Gemm", value, self.constant(weight), self.constant(bias))

    def split(self, value: str, widths: Sequence[int]) -> list[str]:
        """Add value (n, a) split into pieces of the given numbers of columns; return their names."""
        from onnx import helper

        names = [f"n{len(self._nodes)}_{index}" for index in range(len(widths))]
        sizes = self.constant(np.array(widths))
        self._nodes.append(helper.make_node("Split", [value, sizes], names, axis=1))
        return names

    def finish(self, value: str, shape: Sequence[int] = ()) -> bytes:
        """Make the last node's value y (n, *shape), () for one number per row; return the checked model's bytes."""
        from onnx import TensorProto, checker, helper

        if not shape:
            value = self.add("Reshape", value, self.constant(np.array([-1])))
        if list(self._nodes[-1].output) != [value]:
            raise ValueError(f"{value} is not the output of the last node")
        self._nodes[-1].output[0] = "y"
        graph = helper.make_graph(
            self._nodes,
            "lsds",
            [helper.make_tensor_value_info("x", TensorProto.FLOAT, ["n", *self._shape])],
            [helper.make_tensor_value_info("y", TensorProto.FLOAT, ["n", *shape])],
            self._constants,
        )
        domains = {node.domain for node in self._nodes}
        opsets = [helper.make_opsetid("", OPSET)]
        if "ai.onnx.ml" in domains:
            opsets.append(helper.make_opsetid("ai.onnx.ml", ML_OPSET))
        model = helper.make_model(graph, opset_imports=opsets, ir_version=IR, producer_name="lsds")
        checker.check_model(model)
        content: bytes = model.SerializeToString()
        return content
