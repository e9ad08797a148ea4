"""From a trained model to a policy file: the deterministic action as a graph of arithmetic.

The graph is written node by node (no tracing), so that the same weights give the same bytes:

    observation -> normaliser -> fixed differences -> layers -> action -> limits
"""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.torch_layers import FlattenExtractor
from torch import nn

import pam_envs
from agents.checkpoint import write_atomically
from agents.networks import LayersAndInputs, LinearFeatures
from agents.onnx_file import CARD, INPUT, OUTPUT, SCHEMA, check_graph
from agents.policy import describe

OPSET, IR = 17, 8
ACTIVATIONS = {nn.Tanh: "Tanh", nn.ReLU: "Relu", nn.ELU: "Elu"}


class Graph:
    """A chain of nodes under construction; ``last`` is what the next one reads."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.numbers: list[onnx.TensorProto] = []
        self.last = INPUT

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
        self.last = f"v{len(self.nodes)}"
        self.nodes.append(helper.make_node(operator, inputs, [self.last], **attributes))
        return self.last

    def linear(self, layer: nn.Linear) -> None:
        """Append ``x W^T + b``."""
        self.add("Gemm", _array(layer.weight), _array(layer.bias), transB=1)


def export_policy(
    model: BaseAlgorithm, path: str | Path, card: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Write the model's deterministic action as a policy file, and its card beside it.

    Parameters
    ----------
    model : PPO or SAC
        With its environment (a :class:`agents.sb3_vec_env.BatchVecEnv`, wrapped or not), from
        which come the signals and the observation's normaliser.
    path : str or Path
        ``policy.onnx``; the card is written to ``policy.json``.
    card : mapping, optional
        Further entries of the card: seed, steps, command.

    Returns
    -------
    dict
        The card.

    Raises
    ------
    ValueError
        If the model has layers that have no counterpart here.
    """
    path = Path(path)
    full = {**_facts(model), **(card or {})}
    data = policy_bytes(model, full)
    write_atomically(path, data)
    text = json.dumps(full, indent=1, sort_keys=True) + "\n"
    write_atomically(path.with_suffix(".json"), text.encode())
    return full


def policy_bytes(model: Any, card: Mapping[str, Any]) -> bytes:
    """Return the policy file's bytes: a function of weights, normaliser and card alone."""
    graph = Graph()
    _normaliser(graph, model)
    if isinstance(model, PPO):
        _ppo_action(graph, model)
    elif isinstance(model, SAC):
        _sac_action(graph, model)
    else:
        raise ValueError(f"{type(model).__name__} cannot be exported; PPO and SAC can")
    _limits(graph, model)
    made = _model(graph, len(card["signals"]), len(card["action_signals"]))
    made.metadata_props.add(key=CARD, value=json.dumps(dict(card), sort_keys=True))
    onnx.checker.check_model(made)
    check_graph(made)
    data: bytes = made.SerializeToString(deterministic=True)
    return data


def _facts(model: BaseAlgorithm) -> dict[str, Any]:
    env = model.get_env()
    if env is None:
        raise ValueError("the model has no environment; call model.set_env(env) first")
    spec = env.get_attr("spec")[0]
    own = {"info", "num_envs", "vectorization_mode", "threads"}
    names = ("torch", "stable_baselines3", "gymnasium", "numpy", "onnx")
    return {
        "schema": SCHEMA,
        "env": spec.id,
        "env_kwargs": {k: _plain(v) for k, v in spec.kwargs.items() if k not in own},
        "plant": env.get_attr("plant")[0].digest(),
        "signals": describe(env.get_attr("signals")[0]),
        "action_signals": describe(env.get_attr("action_signals")[0]),
        "algo": type(model).__name__.lower(),
        "steps": int(model.num_timesteps),
        "seed": model.seed,
        "versions": {
            "pam_envs": pam_envs.__version__,
            "python": platform.python_version(),
            **{name: version(name) for name in names},
        },
    }


def _plain(value: Any) -> Any:
    """Return an argument of the environment as JSON can hold it."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if callable(getattr(value, "digest", None)):
        return {"digest": value.digest()}
    plain = value is None or isinstance(value, (bool, int, float, str))
    return value if plain else str(value)


def _normaliser(graph: Graph, model: BaseAlgorithm) -> None:
    """Append VecNormalize's arithmetic, in double precision as there."""
    env = model.get_vec_normalize_env()
    if env is None or not env.norm_obs:
        return
    moments: Any = env.obs_rms
    graph.add("Cast", to=TensorProto.DOUBLE)
    graph.add("Sub", np.asarray(moments.mean, np.float64))
    graph.add("Div", np.sqrt(np.asarray(moments.var, np.float64) + env.epsilon))
    graph.add("Clip", np.array(-env.clip_obs), np.array(env.clip_obs))
    graph.add("Cast", to=TensorProto.FLOAT)


def _features(graph: Graph, extractor: nn.Module) -> str:
    """Append the fixed differences; return the name of the inputs."""
    if isinstance(extractor, LinearFeatures):
        matrix: Any = extractor.matrix
        return graph.add("Gemm", _array(matrix), transB=1)
    if isinstance(extractor, FlattenExtractor):
        return graph.last
    raise ValueError(f"the features of {type(extractor).__name__} cannot be exported")


def _ppo_action(graph: Graph, model: PPO) -> None:
    policy = model.policy
    if policy.squash_output or not isinstance(policy.action_net, nn.Linear):
        raise ValueError("only PPO with a plain Gaussian action can be exported")
    inputs = _features(graph, policy.pi_features_extractor)
    layers = policy.mlp_extractor
    _sequence(graph, layers.policy_net)
    if isinstance(layers, LayersAndInputs):
        graph.join("Concat", [graph.last, inputs], axis=1)
    graph.linear(policy.action_net)


def _sac_action(graph: Graph, model: SAC) -> None:
    actor = model.policy.actor
    space: Any = model.action_space
    _features(graph, actor.features_extractor)
    _sequence(graph, actor.latent_pi)
    _sequence(graph, [actor.mu])
    graph.add("Tanh")
    graph.add("Add", np.full(1, 1.0, np.float32))
    graph.add("Mul", np.full(1, 0.5, np.float32))
    graph.add("Mul", np.asarray(space.high - space.low, np.float32))
    graph.add("Add", np.asarray(space.low, np.float32))


def _sequence(graph: Graph, layers: Any) -> None:
    for layer in layers:
        if isinstance(layer, nn.Linear):
            graph.linear(layer)
        elif type(layer) in ACTIVATIONS:
            graph.add(ACTIVATIONS[type(layer)])
        else:
            raise ValueError(f"a layer of {type(layer).__name__} cannot be exported")


def _limits(graph: Graph, model: BaseAlgorithm) -> None:
    """Hold the action within the environment's range."""
    space: Any = model.action_space
    graph.add("Max", np.asarray(space.low, np.float32))
    graph.add("Min", np.asarray(space.high, np.float32))


def _model(graph: Graph, signals: int, actions: int) -> onnx.ModelProto:
    graph.nodes[-1].output[0] = OUTPUT
    inside = helper.make_graph(
        graph.nodes,
        "policy",
        [helper.make_tensor_value_info(INPUT, TensorProto.FLOAT, ["batch", signals])],
        [helper.make_tensor_value_info(OUTPUT, TensorProto.FLOAT, ["batch", actions])],
        graph.numbers,
    )
    made = helper.make_model(
        inside,
        opset_imports=[helper.make_opsetid("", OPSET)],
        producer_name="pam_envs agents",
        producer_version=pam_envs.__version__,
    )
    made.ir_version = IR
    return made


def _array(tensor: Any) -> NDArray[np.float32]:
    array: NDArray[np.float32] = tensor.detach().cpu().numpy().astype(np.float32)
    return array
