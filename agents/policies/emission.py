"""Trained policies as a kernel, for export: the graph of a policy file as a table of operations.

All values of the graph are float32 numbers in one array. A matrix product accumulates in float64,
and ``tanh`` and ``sigmoid`` come from a series instead of a library, so that an action differs from
that of onnxruntime by some units in the last place.
"""

from dataclasses import replace
from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import numpy_helper

from agents.policies import policy_file as files
from agents.policies.policy import OnnxPolicy
from baselines.emission.book import INPUT, NUMBERS, OUTPUT, STATE, STEPS, ControllerKernel
from pam_envs.export.model import Block, Model, identifier, signal_variables
from pam_envs.kernels.arithmetic import decay
from pam_envs.kernels.build import array_at, kernel

VALUES, TABLE, WEIGHTS = 3, 4, 6
"""Arrays beside the common ones: values of the graph, its operations, its matrices.

An operation has six numbers: code, place of the result, places of two operands, number of elements,
and the inputs of a product or the stride of the second operand."""
COPY, PRODUCT, TANH, SIGMOID, RELU, ADD, SUBTRACT, MULTIPLY, GREATER, LESSER = range(10)
ELEMENTWISE = {
    "Add": ADD, "Sub": SUBTRACT, "Mul": MULTIPLY, "Max": GREATER, "Min": LESSER,
}  # fmt: skip
UNARY = {"Tanh": TANH, "Sigmoid": SIGMOID, "Relu": RELU}
SATURATED = 20.0
AGREEMENT = "within 1e-6 of those of onnxruntime, which multiplies matrices in float32"


@kernel
def tanh(x: float) -> float:
    """Return the hyperbolic tangent to 1e-13."""
    e = decay(2.0 * min(abs(x), SATURATED))
    size = (1.0 - e) / (1.0 + e)
    return size if x >= 0.0 else -size


@kernel
def sigmoid(x: float) -> float:
    """Return the logistic function to 1e-13."""
    return 0.5 + 0.5 * tanh(0.5 * x)


@kernel
def policy_by_address(book: Any, mode: int) -> None:
    """Compute the action of a policy from an observation.

    The values begin with the observation, the start of an episode, and the state. The action and
    the next state follow the operations.
    """
    inputs, outputs = array_at(book, INPUT, 1, 0), array_at(book, OUTPUT, 1, 2)
    state, values = array_at(book, STATE, 1, 2), array_at(book, VALUES, 1, 2)
    table, numbers = array_at(book, TABLE, 2, 1), array_at(book, NUMBERS, 1, 1)
    weights = array_at(book, WEIGHTS, 1, 2)
    n, width = len(inputs), len(state)
    for k in range(n):
        values[k] = inputs[k]
    values[n] = 1.0 if mode & 1 else 0.0
    for k in range(width):
        values[n + 1 + k] = 0.0 if mode & 1 else state[k]
    last = len(table) - 2
    for i in range(last):
        code, to, a, b = table[i][0], table[i][1], table[i][2], table[i][3]
        size, other = table[i][4], table[i][5]
        for k in range(size):
            x = values[a + k] if code != PRODUCT else 0.0
            if code == COPY:
                y = x
            elif code == PRODUCT:
                y = 0.0
                for j in range(other):
                    y = y + float(values[a + j]) * float(weights[b + k * other + j])
            elif code == TANH:
                y = tanh(x)
            elif code == SIGMOID:
                y = sigmoid(x)
            elif code == RELU:
                y = max(x, 0.0)
            else:
                w = values[b + k * other]
                if code == ADD:
                    y = x + w
                elif code == SUBTRACT:
                    y = x - w
                elif code == MULTIPLY:
                    y = x * w
                elif code == GREATER:
                    y = max(x, w)
                else:
                    y = min(x, w)
            values[to + k] = y
    for k in range(len(outputs)):
        outputs[k] = values[table[last][2] + k]
    for k in range(width):
        state[k] = values[table[last + 1][2] + k]
    numbers[STEPS] = numbers[STEPS] + 1


class Program:
    """Operations of a graph on numbers of one array, under construction."""

    def __init__(self, graph: Any, signals: int, actions: int, memory: int, corrects: bool) -> None:
        self.numbers: list[float] = []
        self.weights: list[float] = []
        self.table: list[tuple[int, ...]] = []
        self._where: dict[str, tuple[int, int]] = {}
        self._constants = {t.name: numpy_helper.to_array(t) for t in graph.initializer}
        self._reserve(files.INPUT, signals)
        if corrects:
            self._reserve(files.CONTROLLER, actions)
        self._reserve(files.START, 1)
        self._reserve(files.STATE, max(1, memory))
        for node in graph.node:
            self._add(node)
        action, _ = self._where[files.OUTPUT]
        after = self._where[files.AFTER][0] if memory else self._where[files.STATE][0]
        self.table += [(COPY, 0, at, 0, 0, 0) for at in (action, after)]

    def _reserve(self, name: str, size: int) -> int:
        at = len(self.numbers)
        self.numbers += [0.0] * size
        self._where[name] = (at, size)
        return at

    def _at(self, name: str) -> tuple[int, int]:
        """Return place and size of a value; a constant is placed when it is first used."""
        if name not in self._where:
            flat = self._constants[name].ravel()
            self._where[name] = (len(self.numbers), len(flat))
            self.numbers += flat.astype(np.float64).tolist()
        return self._where[name]

    def _add(self, node: Any) -> None:
        out, inputs = node.output[0], node.input
        if node.op_type == "Gemm":
            self._product(node)
        elif node.op_type == "Concat":
            places = [self._at(name) for name in inputs]
            to = self._reserve(out, sum(size for _, size in places))
            for at, size in places:
                self.table.append((COPY, to, at, 0, size, 0))
                to += size
        elif node.op_type == "Slice":
            first, end = (int(self._constants[name][0]) for name in inputs[1:3])
            at, _ = self._at(inputs[0])
            to = self._reserve(out, end - first)
            self.table.append((COPY, to, at + first, 0, end - first, 0))
        elif node.op_type == "Gather":
            at, _ = self._at(inputs[0])
            columns = self._constants[inputs[1]]
            to = self._reserve(out, len(columns))
            self.table += [(COPY, to + k, at + int(c), 0, 1, 0) for k, c in enumerate(columns)]
        elif node.op_type in UNARY:
            at, size = self._at(inputs[0])
            self.table.append((UNARY[node.op_type], self._reserve(out, size), at, 0, size, 0))
        elif node.op_type in ELEMENTWISE:
            self._elementwise(node)
        else:
            raise ValueError(
                f"a policy with the operation {node.op_type} cannot be exported; known are Gemm, "
                f"Concat, Slice, Gather, {', '.join((*UNARY, *ELEMENTWISE))}"
            )

    def _product(self, node: Any) -> None:
        """Append ``x W^T + b``."""
        flags = {a.name: onnx.helper.get_attribute_value(a) for a in node.attribute}
        if flags != {"transB": 1}:
            raise ValueError(f"a Gemm with {flags} cannot be exported; it must be x W^T + b")
        at, width = self._at(node.input[0])
        matrix, weights = self._constants[node.input[1]], len(self.weights)
        self.weights += matrix.ravel().tolist()
        rows = len(matrix)
        bias = self._at(node.input[2])[0] if len(node.input) > 2 else None
        to = self._reserve(node.output[0], rows)
        self.table.append((PRODUCT, to, at, weights, rows, width))
        if bias is not None:
            self.table.append((ADD, to, to, bias, rows, 1))

    def _elementwise(self, node: Any) -> None:
        """Append an operation on two values, of which one may be a single number."""
        (a, size), (b, other) = (self._at(name) for name in node.input)
        code = ELEMENTWISE[node.op_type]
        if size < other and code != SUBTRACT:  # the longer one first
            (a, size), (b, other) = (b, other), (a, size)
        if other not in (1, size):
            raise ValueError(f"{node.op_type} of {size} and {other} numbers cannot be exported")
        self.table.append((code, self._reserve(node.output[0], size), a, b, size, int(other > 1)))


def policy_model(name: str, policy: OnnxPolicy, period: float) -> Model:
    """Return the model of a policy for export.

    A policy that corrects a controller has the action of that controller as further inputs,
    ``controller.NAME``.

    Parameters
    ----------
    name : str
        Its name in the catalogue.
    period : float
        Control period [s].

    Raises
    ------
    ValueError
        If its graph has an operation that the kernel does not know.
    """
    signals, actions, corrects = policy.signals, policy.action_signals, bool(policy.corrects)
    graph = onnx.load_model_from_string(policy.data).graph
    program = Program(graph, len(signals), len(actions), policy.memory, corrects)
    inputs = signal_variables(signals, "input")
    if corrects:
        given = signal_variables(actions, "input", "controller.")
        inputs += [replace(v, index=len(signals) + v.index) for v in given]
    arrays: dict[str, NDArray[Any]] = {
        "input": np.zeros(len(inputs)),
        "output": np.zeros(len(actions), np.float32),
        "state": np.zeros(max(1, policy.memory), np.float32),
        "values": np.array(program.numbers, np.float32),
        "table": np.array(program.table, np.int64),
        "numbers": np.zeros(4, np.int64),
        "weights": np.array(program.weights, np.float32),
    }
    return Model(
        f"{name}, a policy",
        identifier(name),
        period,
        tuple(Block(k, v, v.shape, k in ("table", "weights")) for k, v in arrays.items()),
        {"kernel": ControllerKernel("policy", policy_by_address, len(arrays))},
        tuple(inputs),
        tuple(signal_variables(actions, "output", "action.")),
        (),
        "controller",
        {"policy": f"{policy.name}, digest {policy.digest()}"},
        AGREEMENT,
    )
