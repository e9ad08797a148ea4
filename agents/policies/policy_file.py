"""Policy files: checks before execution, the card inside, and the training record beside.

An ONNX file is data, a graph of arithmetic and its numbers. The checks refuse the ways in which a
graph could still do harm: weights in other files, operators of other vendors, loops, size.
"""

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import onnx
import onnx.shape_inference

from pam_envs.files import write_bytes
from pam_envs.wording import printable, shown

POLICY, RECORD = "policy.onnx", "policy.json"  # files of a finished run
MOST_BYTES = 5_000_000
MOST_NODES = 500
MOST_NUMBERS, MOST_IN_ALL = 100_000, 1_000_000
"""Largest numbers per row of one value, and of all values together."""
CARD = "pam_policy"
SCHEMA = 1
INPUT, OUTPUT = "observation", "action"
CONTROLLER = "controller"  # input of a policy that corrects a controller: the controller's action
STATE, START, AFTER = "state", "start", "state_after"
"""Inputs and output of a policy with a state; ``start`` is 1 where an episode begins."""
OPERATORS = frozenset(
    (
        *("Abs", "Add", "Cast", "Clip", "Concat", "Constant", "Div", "Elu", "Exp", "Flatten"),
        *("Gather", "Gelu", "Gemm", "HardSigmoid", "Identity", "LayerNormalization", "LeakyRelu"),
        *("Log", "MatMul", "Max", "Min", "Mul", "Neg", "Relu", "Reshape", "Selu", "Sigmoid"),
        *("Slice", "Softplus", "Softsign", "Split", "Sqrt", "Squeeze", "Sub", "Tanh"),
        *("Transpose", "Unsqueeze"),
    )
)
"""Permitted operators: no loops, and none that creates a tensor from a size."""


class PolicyFileError(ValueError):
    """An invalid or refused policy file; the message contains the remedy."""


@dataclass(frozen=True)
class PolicyFile:
    """Bytes and card of a checked policy; see :func:`agents.export.export.export_policy`."""

    data: bytes
    card: dict[str, Any]


def read(path: str | Path) -> PolicyFile:
    """Return the checked file; a PolicyFileError unless it is plain arithmetic with a card."""
    path = Path(path)
    try:
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise PolicyFileError(f"{path} cannot be read: {error.strerror}") from error
    if len(data) > MOST_BYTES:
        raise PolicyFileError(f"{path.name} is larger than {MOST_BYTES:,} bytes; export less")
    _refuse_code(path.name, data)
    try:
        model = onnx.load_model_from_string(data)
    except Exception as error:
        raise PolicyFileError(f"{path.name} is not an ONNX file, or a damaged one") from error
    try:
        check_graph(model)
        return PolicyFile(data, _card(model))
    except PolicyFileError as error:
        raise PolicyFileError(f"{path.name}: {printable(str(error))}") from error


def write_policy(path: Path, data: bytes, record: Mapping[str, Any]) -> None:
    """Write a policy ``*.onnx`` and, before it, its training record ``*.json`` with its SHA-256.

    The order ensures that :func:`finished` never accepts a policy without its record, even if the
    process is killed.
    """
    said = {**record, "sha256": hashlib.sha256(data).hexdigest()}
    text = json.dumps(said, indent=1, sort_keys=True) + "\n"
    write_bytes(path.with_suffix(".json"), text.encode())
    write_bytes(path, data)


def record_of(path: Path) -> dict[str, Any]:
    """Return the training record beside a policy; empty where there is none."""
    try:
        record = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}


def finished(path: str | Path) -> dict[str, Any] | None:
    """Return the card of a policy, None unless both its files exist and agree."""
    path = Path(path)
    try:
        file = read(path)
    except PolicyFileError:
        return None
    same = record_of(path).get("sha256") == hashlib.sha256(file.data).hexdigest()
    return file.card if same else None


def _refuse_code(name: str, data: bytes) -> None:
    """Refuse files that run code when they are opened."""
    kinds = {b"PK": "a zip file (as of stable-baselines3 or torch)", b"\x80": "a pickle"}
    for mark, kind in kinds.items():
        if data.startswith(mark):
            raise PolicyFileError(
                f"{name} is {kind}, which can run any code when it is opened, so it was not. "
                "Policies are ONNX files here. If the file is your own, load it with the program "
                "that wrote it and call agents.export.export.export_policy(model, 'policy.onnx')"
            )


def check_graph(model: onnx.ModelProto) -> None:
    """Raise unless the model is plain arithmetic in one file."""
    domains = {entry.domain for entry in model.opset_import} | {n.domain for n in model.graph.node}
    foreign = sorted(domains - {"", "ai.onnx"})
    if foreign:
        raise PolicyFileError(f"uses operators of {', '.join(foreign)}; only standard ones are run")
    if model.functions or model.training_info:
        raise PolicyFileError("has functions or training parts; export the bare policy")
    if model.graph.sparse_initializer:
        raise PolicyFileError("has sparse weights; store them dense")
    for node in model.graph.node:
        if node.op_type not in OPERATORS:
            raise PolicyFileError(
                f"uses the operator {node.op_type}; policies are made of "
                + ", ".join(sorted(OPERATORS))
            )
        for attribute in node.attribute:
            if attribute.HasField("g") or attribute.graphs:
                raise PolicyFileError(f"{node.op_type} has a graph inside; policies do not loop")
            _check_tensors([attribute.t, *attribute.tensors])
    _check_tensors(model.graph.initializer)
    if len(model.graph.node) > MOST_NODES:
        raise PolicyFileError(
            f"has {len(model.graph.node):,} operators; at most {MOST_NODES} are run"
        )
    _check_sizes(model)


def _check_tensors(tensors: Any) -> None:
    for tensor in tensors:
        if tensor.data_location == onnx.TensorProto.EXTERNAL or tensor.external_data:
            raise PolicyFileError(
                f"the weights {tensor.name!r} are in another file, which is not opened; "
                "export with the weights inside"
            )


def _check_sizes(model: onnx.ModelProto) -> None:
    """Refuse values of unknown or large size, apart from the batch axis.

    Sizes that the file declares of its own values are not believed. An axis that stays unknown is
    a multiple of the number of rows, which those of a single row bound.
    """
    known = _inferred(model)
    single = _inferred(model, rows=1)
    total = 0
    for node in model.graph.node:
        for name in filter(None, node.output):
            dims, one = known.get(name), single.get(name)
            numbers = None if one is None or 0 in one else math.prod(one)
            total += numbers or 0
            if (
                dims is None
                or dims.count(0) > 1
                or numbers is None
                or numbers > MOST_NUMBERS
                or total > MOST_IN_ALL
            ):
                raise PolicyFileError(
                    f"the size of {shown(name)} (operator {node.op_type}) is not known in advance "
                    f"or above {MOST_NUMBERS:,} numbers per row, or all values together have more "
                    f"than {MOST_IN_ALL:,}; export a plain feed-forward network"
                )
    for output in model.graph.output:
        declared = [d.dim_value for d in output.type.tensor_type.shape.dim]
        found = known[output.name] or []
        pairs = zip(declared, found, strict=False)
        if len(declared) != len(found) or not all(a == b for a, b in pairs if a and b):
            raise PolicyFileError(f"its shapes do not fit together: {shown(output.name)}")


def _inferred(model: onnx.ModelProto, rows: int = 0) -> dict[str, list[int] | None]:
    """Return the shape of each value, with 0 for an unknown axis, for a number of rows if given."""
    bare = onnx.ModelProto()
    bare.CopyFrom(model)
    del bare.graph.value_info[:]
    for output in bare.graph.output:
        output.type.tensor_type.ClearField("shape")
    for given in bare.graph.input if rows else ():
        for first in given.type.tensor_type.shape.dim[:1]:
            first.dim_value = rows
    try:
        inferred = onnx.shape_inference.infer_shapes(bare, check_type=True, strict_mode=True)
    except Exception as error:
        raise PolicyFileError(f"its shapes do not fit together: {error}") from error
    found = {}
    for value in [*inferred.graph.value_info, *inferred.graph.output]:
        kind = value.type.tensor_type
        dims = [d.dim_value for d in kind.shape.dim]
        found[value.name] = dims if kind.HasField("shape") else None
    return found


def _card(model: onnx.ModelProto) -> dict[str, Any]:
    texts = {entry.key: entry.value for entry in model.metadata_props}
    if CARD not in texts:
        raise PolicyFileError(
            "has no card with its signals; export it with agents.export.export.export_policy"
        )
    try:
        card = json.loads(texts[CARD])
    except (ValueError, RecursionError) as error:
        raise PolicyFileError(f"its card is not JSON: {error}") from error
    if not isinstance(card, dict) or card.get("schema") != SCHEMA:
        raise PolicyFileError(f"its card is not of schema {SCHEMA}; export it with this version")
    lacking = {"env", "env_kwargs", "signals", "action_signals", "algo", "steps", "seed"} - set(
        card
    )
    if lacking:
        raise PolicyFileError(f"its card lacks {', '.join(sorted(lacking))}")
    return card
