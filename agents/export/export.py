"""Export of a trained model: its deterministic action as a graph of arithmetic in ONNX."""

import json
import platform
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import onnx
from onnx import TensorProto
from sb3_contrib import TQC, RecurrentPPO
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.torch_layers import FlattenExtractor
from torch import nn

import pam_envs
from agents.export.graph import Graph, array
from agents.export.recording import record
from agents.policies.networks import LayersAndInputs, LinearFeatures
from agents.policies.policy import describe
from agents.policies.policy_file import CARD, CONTROLLER, INPUT, SCHEMA, check_graph, write_policy
from agents.vec_envs.gauge import ErrorMean
from agents.vec_envs.history import HistoryVecEnv
from agents.vec_envs.privileged import PrivilegedVecEnv
from agents.vec_envs.residual import ResidualVecEnv

ALGORITHMS: dict[str, type[BaseAlgorithm]] = {
    "ppo": PPO,
    "sac": SAC,
    "tqc": TQC,
    "recurrent_ppo": RecurrentPPO,
}
OWN = ("info", "num_envs", "vectorization_mode", "threads")
"""Arguments of the batch, which do not affect the policy."""
PACKAGES = ("torch", "stable_baselines3", "sb3_contrib", "gymnasium", "numpy", "onnx")
L = TypeVar("L")


def export_policy(
    model: BaseAlgorithm,
    path: str | Path,
    card: Mapping[str, Any] | None = None,
    training: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Write the model's deterministic action as a policy file, and return its card.

    ``model`` is a PPO, RecurrentPPO, SAC or TQC with its environment (a
    :class:`agents.vec_envs.batch.BatchVecEnv`, wrapped or not), which holds the signals and the
    observation's normaliser. An actor that sees the plant's parameters is exported with the nominal
    ones. ``card`` are further entries of the card (seed, steps, command);
    ``training``, its cost (times, machine), is written beside ``path``, into ``policy.json``. A
    ValueError says that the model has layers that the export does not support, or corrects a
    controller that is mostly saturated.
    """
    full = {**facts(model), **(card or {})}
    write_policy(Path(path), policy_bytes(model, full), {"training": dict(training or {})})
    return full


def policy_bytes(model: Any, card: Mapping[str, Any]) -> bytes:
    """Return the bytes of the policy file, a function of weights, normaliser and card alone."""
    graph = Graph()
    env = model.get_env()
    corrects, past = layer(env, ResidualVecEnv), layer(env, HistoryVecEnv)
    if corrects is not None:
        graph.join("Concat", [INPUT, CONTROLLER], axis=1)
    if past is not None:
        graph.past(past.columns, past.frames * past.stride, past.shown)
    _normaliser(graph, model)
    _action(graph, model)
    _limits(graph, model.action_space)
    if corrects is not None:
        graph.add("Mul", np.full(1, corrects.scale, np.float32))
        if corrects.gauge is not None:
            change = graph.last
            graph.join("Mul", [change, _factor(graph, corrects.gauge)])
        graph.join("Add", [CONTROLLER, graph.last])
        _limits(graph, corrects.range)
    signals, actions = len(card["signals"]), len(card["action_signals"])
    made = graph.model(signals, actions, corrects is not None)
    made.metadata_props.add(key=CARD, value=json.dumps(dict(card), sort_keys=True))
    onnx.checker.check_model(made)
    check_graph(made)
    data: bytes = made.SerializeToString(deterministic=True)
    return data


def _factor(graph: Graph, gauge: ErrorMean) -> str:
    """Append the arithmetic of :class:`ErrorMean`; return the name of its factor."""
    count = len(gauge.matrix)

    def followed(before: str, share: np.float32) -> str:
        """Return ``before + share * (last - before)``, which is kept."""
        graph.join("Sub", [graph.last, before])
        graph.add("Mul", np.full(1, share, np.float32))
        graph.keep(graph.join("Add", [before, graph.last]))
        return graph.last

    smooth, mean = graph.recall(count), graph.recall(1)
    graph.last = INPUT
    graph.add("Gemm", gauge.matrix, transB=1)
    present = followed(smooth, gauge.smoothing)
    negative = graph.add("Mul", np.full(1, -1.0, np.float32))
    graph.join("Max", [present, negative])
    graph.add("Gemm", np.full((1, count), 1.0 / count, np.float32), transB=1)
    followed(mean, gauge.averaging)
    graph.add("Mul", np.full(1, 1.0 / gauge.full, np.float32))
    graph.add("Max", np.full(1, gauge.least, np.float32))
    return graph.add("Min", np.ones(1, np.float32))


def layer(env: Any, kind: type[L]) -> L | None:
    """Return the wrapper of the given class around the environment, or None."""
    while hasattr(env, "venv"):
        if isinstance(env, kind):
            return env
        env = env.venv
    return None


def facts(model: BaseAlgorithm) -> dict[str, Any]:
    """Return a card's entries on a model: environment, plants, signals, algorithm, versions."""
    env = model.get_env()
    if env is None:
        raise ValueError("the model has no environment; call model.set_env(env) first")
    spec = env.get_attr("spec")[0]
    names = {kind: name for name, kind in ALGORITHMS.items()}
    made = {
        "schema": SCHEMA,
        "env": spec.id,
        "env_kwargs": _in_common([kind for kind, _ in _kinds(env)]),
        "plants": plants_of(env),
        "signals": describe(env.get_attr("signals")[0]),
        "action_signals": describe(env.get_attr("action_signals")[0]),
        "algo": names.get(type(model), type(model).__name__.lower()),
        "steps": int(model.num_timesteps),
        "seed": model.seed,
        "versions": {
            "pam_envs": pam_envs.__version__,
            "python": platform.python_version(),
            **{name: version(name) for name in PACKAGES},
        },
    }
    corrects = layer(env, ResidualVecEnv)
    return made if corrects is None else {**made, "baseline": _baseline(corrects, spec.id)}


def plants_of(env: Any) -> list[str]:
    """Return the distinct digests of the rows' nominal plants."""
    return list(dict.fromkeys(plant.digest() for _, plant in _kinds(env)))


def _kinds(env: Any) -> Iterator[tuple[dict[str, Any], Any]]:
    """Yield the environment's arguments and the nominal plant of each kind of row."""
    for batch in env.unwrapped.batches:
        kind = {name: value for name, value in batch.spec.kwargs.items() if name not in OWN}
        yield kind, batch.unwrapped.plant


def _in_common(kinds: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the arguments that are equal in all kinds."""
    first, *others = ({name: _plain(value) for name, value in kind.items()} for kind in kinds)
    return {
        name: value
        for name, value in first.items()
        if all(name in other and other[name] == value for other in others)
    }


def _baseline(layer: ResidualVecEnv, env: str) -> dict[str, Any]:
    """Return the card's entry on the corrected controller, recorded once for an environment."""
    if layer.record is not None:
        return layer.record
    kinds: dict[str, list[dict[str, Any]]] = {}
    for kind, plant in _kinds(layer):
        kinds.setdefault(plant.digest(), []).append(kind)
    pairs = zip(layer.plants, layer.controllers, strict=True)
    made = {plant.digest(): controller for plant, (_, controller) in pairs}
    recorded = [
        {"plant": digest, **record(env, kinds[digest], controller, layer.name).as_dict()}
        for digest, controller in made.items()
        if digest in kinds
    ]
    layer.record = {"name": layer.name, "scale": float(layer.scale), "recorded": recorded}
    return layer.record


def _plain(value: Any) -> Any:
    """Return an argument of the environment as JSON values."""
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
    """Append VecNormalize's arithmetic, in its double precision."""
    env = model.get_vec_normalize_env()
    if env is None or not env.norm_obs:
        return
    moments: Any = env.obs_rms
    graph.add("Cast", to=TensorProto.DOUBLE)
    graph.add("Sub", np.asarray(moments.mean, np.float64))
    graph.add("Div", np.sqrt(np.asarray(moments.var, np.float64) + env.epsilon))
    graph.add("Clip", np.array(-env.clip_obs), np.array(env.clip_obs))
    graph.add("Cast", to=TensorProto.FLOAT)


def _features(graph: Graph, extractor: nn.Module, hidden: PrivilegedVecEnv | None = None) -> str:
    """Append the fixed differences; return the name of the inputs.

    The parameters that an actor sees, the last columns of its matrix, are the nominal ones.
    """
    if isinstance(extractor, LinearFeatures):
        matrix = array(extractor.matrix)
        space: Any = None if hidden is None else hidden.venv.observation_space
        if hidden is None or matrix.shape[1] == space.shape[0]:
            return graph.add("Gemm", matrix, transB=1)
        seen, parameters = np.split(matrix, [space.shape[0]], axis=1)
        return graph.add("Gemm", seen, parameters @ hidden.nominal, transB=1)
    if isinstance(extractor, FlattenExtractor):
        return graph.last
    raise ValueError(f"the features of {type(extractor).__name__} cannot be exported")


def _action(graph: Graph, model: Any) -> None:
    if isinstance(model, (PPO, RecurrentPPO)):
        _gaussian_action(graph, model.policy, layer(model.get_env(), PrivilegedVecEnv))
    elif isinstance(model, (SAC, TQC)):
        _squashed_action(graph, model)
    else:
        raise ValueError(f"{type(model).__name__} cannot be exported; PPO, SAC and TQC can")


def _gaussian_action(graph: Graph, policy: Any, hidden: PrivilegedVecEnv | None) -> None:
    """Append the mean action of PPO, recurrent or not."""
    if policy.squash_output or not isinstance(policy.action_net, nn.Linear):
        raise ValueError("only PPO with a plain Gaussian action can be exported")
    inputs = _features(graph, policy.pi_features_extractor, hidden)
    layers, lstm = policy.mlp_extractor, getattr(policy, "lstm_actor", None)
    beside = isinstance(layers, LayersAndInputs)
    if lstm is not None:
        if lstm.num_layers != 1:
            raise ValueError(f"n_lstm_layers = {lstm.num_layers}: only one layer can be exported")
        output = graph.lstm(lstm)
        if beside:
            graph.join("Concat", [output, inputs], axis=1)
    graph.layers(layers.policy_net)
    if beside:
        graph.join("Concat", [graph.last, inputs], axis=1)
    graph.linear(policy.action_net)


def _squashed_action(graph: Graph, model: SAC | TQC) -> None:
    actor: Any = model.policy.actor
    space: Any = model.action_space
    _features(graph, actor.features_extractor)
    graph.layers(actor.latent_pi)
    graph.layers([actor.mu])
    graph.add("Tanh")
    graph.add("Add", np.full(1, 1.0, np.float32))
    graph.add("Mul", np.full(1, 0.5, np.float32))
    graph.add("Mul", np.asarray(space.high - space.low, np.float32))
    graph.add("Add", np.asarray(space.low, np.float32))


def _limits(graph: Graph, space: Any) -> None:
    """Clip the action to a range."""
    graph.add("Max", np.asarray(space.low, np.float32))
    graph.add("Min", np.asarray(space.high, np.float32))
