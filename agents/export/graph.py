"""Construction of an ONNX graph node by node, so that the same weights give the same bytes.

    observation (and controller) -> history -> normaliser -> fixed differences -> LSTM -> layers
                                            -> action -> limits

The state of a policy is explicit: ``state`` is an input beside the observation, ``state_after`` an
output, and the graph resets the state where ``start`` is 1, at the beginning of an episode.
"""

from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper
from torch import nn

import pam_envs
from agents.policies.policy_file import AFTER, CONTROLLER, INPUT, OUTPUT, START, STATE

OPSET, IR = 17, 8
ACTIVATIONS = {nn.Tanh: "Tanh", nn.ReLU: "Relu", nn.ELU: "Elu"}


class Graph:
    """Chain of nodes under construction; ``last`` is the input of the next one."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.numbers: list[onnx.TensorProto] = []
        self.last = INPUT
        self.state_width = 0
        self._after: list[str] = []
        self._running = ""

    def number(self, value: NDArray[Any]) -> str:
        """Return the name of a constant."""
        name = f"c{len(self.numbers)}"
        self.numbers.append(numpy_helper.from_array(np.ascontiguousarray(value), name))
        return name

    def add(self, operator: str, *constants: NDArray[Any], **attributes: Any) -> str:
        """Append a node that reads ``last`` and constants; return its output's name."""
        inputs = [self.last, *(self.number(value) for value in constants)]
        return self.join(operator, inputs, **attributes)

    def join(self, operator: str, inputs: list[str], **attributes: Any) -> str:
        """Append a node that reads named values; return its output's name."""
        return self.several(operator, inputs, 1, **attributes)[0]

    def several(
        self, operator: str, inputs: list[str], outputs: int, **attributes: Any
    ) -> list[str]:
        """Append a node with several outputs; return their names."""
        at = len(self.nodes)
        names = [f"v{at}" if not i else f"v{at}_{i}" for i in range(outputs)]
        self.nodes.append(helper.make_node(operator, inputs, names, **attributes))
        self.last = names[0]
        return names

    def linear(self, layer: nn.Linear) -> None:
        """Append ``x W^T + b``."""
        self.add("Gemm", array(layer.weight), array(layer.bias), transB=1)

    def layers(self, layers: Any) -> None:
        """Append layers one after the other."""
        for layer in layers:
            if isinstance(layer, nn.Linear):
                self.linear(layer)
            elif type(layer) in ACTIVATIONS:
                self.add(ACTIVATIONS[type(layer)])
            else:
                raise ValueError(f"a layer of {type(layer).__name__} cannot be exported")

    # --- state ------------------------------------------------------------------------------

    def recall(self, width: int) -> str:
        """Return the next ``width`` values of the state, 0 where an episode begins."""
        before = self.last
        if not self._running:
            self._running = self.join("Sub", [self.number(np.ones(1, np.float32)), START])
        ends = (self.state_width, self.state_width + width)
        part = self.cut(STATE, *ends)
        self.state_width += width
        kept = self.join("Mul", [part, self._running])
        self.last = before
        return kept

    def keep(self, name: str) -> None:
        """Append a value to the state after the step, in the order of ``recall``."""
        self._after.append(name)

    def cut(self, name: str, first: int, end: int) -> str:
        """Return the columns from ``first`` up to ``end``."""
        bounds = [self.number(np.array([i], np.int64)) for i in (first, end, 1)]
        return self.join("Slice", [name, *bounds])

    def past(self, columns: list[int], frames: int, shown: list[int]) -> None:
        """Append past values of some columns to the input, the latest first.

        The state holds those of the last ``frames`` control periods; ``shown`` are the places of
        the appended ones in it.
        """
        seen = self.last
        held = self.recall(frames * len(columns))
        chosen = self.join("Gather", [seen, self.number(np.array(columns, np.int64))], axis=1)
        fresh = self.join("Concat", [chosen] * frames, axis=1)
        first = self.join("Mul", [fresh, START])
        past = self.join("Add", [held, first])
        recent = [] if frames == 1 else [self.cut(past, 0, (frames - 1) * len(columns))]
        self.keep(self.join("Concat", [chosen, *recent], axis=1))
        if len(shown) < frames * len(columns):
            past = self.join("Gather", [past, self.number(np.array(shown, np.int64))], axis=1)
        self.join("Concat", [seen, past], axis=1)

    def lstm(self, layer: nn.LSTM) -> str:
        """Append one step of a long short-term memory; return the name of its output."""
        seen, size = self.last, layer.hidden_size
        hidden, cell = self.recall(size), self.recall(size)
        weights = [array(getattr(layer, f"{kind}_l0")) for kind in _WEIGHTS]
        names = [self.number(value) for value in weights]
        from_inputs = self.join("Gemm", [seen, names[0], names[1]], transB=1)
        from_memory = self.join("Gemm", [hidden, names[2], names[3]], transB=1)
        both = self.join("Add", [from_inputs, from_memory])
        sizes = self.number(np.full(4, size, np.int64))
        put, forget, new, show = self.several("Split", [both, sizes], 4, axis=1)
        kept = self.join("Mul", [self.join("Sigmoid", [forget]), cell])
        put, new = self.join("Sigmoid", [put]), self.join("Tanh", [new])
        cell = self.join("Add", [kept, self.join("Mul", [put, new])])
        show = self.join("Sigmoid", [show])
        output = self.join("Mul", [show, self.join("Tanh", [cell])])
        self.keep(output)
        self.keep(cell)
        self.last = output
        return output

    # --- model ------------------------------------------------------------------------------

    def model(self, signals: int, actions: int, corrects: bool) -> onnx.ModelProto:
        """Return the ONNX model whose output is ``last``."""
        self.nodes[-1].output[0] = OUTPUT
        inputs, outputs = [_row(INPUT, signals)], [_row(OUTPUT, actions)]
        if corrects:
            inputs.append(_row(CONTROLLER, actions))
        if self.state_width:
            self.nodes.append(helper.make_node("Concat", self._after, [AFTER], axis=1))
            inputs += [_row(STATE, self.state_width), _row(START, 1)]
            outputs.append(_row(AFTER, self.state_width))
        made = helper.make_model(
            helper.make_graph(self.nodes, "policy", inputs, outputs, self.numbers),
            opset_imports=[helper.make_opsetid("", OPSET)],
            producer_name="pam_envs agents",
            producer_version=pam_envs.__version__,
        )
        made.ir_version = IR
        return made


_WEIGHTS = ("weight_ih", "bias_ih", "weight_hh", "bias_hh")


def _row(name: str, width: int) -> onnx.ValueInfoProto:
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, ["batch", width])


def array(tensor: Any) -> NDArray[np.float32]:
    """Return a tensor as float32."""
    made: NDArray[np.float32] = tensor.detach().cpu().numpy().astype(np.float32)
    return made
