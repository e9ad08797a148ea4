"""Policy file from a data set: learning, export as ONNX, card."""

import dataclasses
import hashlib
import json
import platform
from importlib.metadata import version
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import onnx

import pam_envs
from agents.export.graph import Graph, array
from agents.offline.data import DataSet
from agents.offline.learners import ALGORITHMS, Policy, Settings, learn
from agents.policies.networks import input_matrix
from agents.policies.policy import describe
from agents.policies.policy_file import CARD, POLICY, SCHEMA, check_graph, write_policy
from agents.settings import presets
from agents.settings.schema import SettingsError
from pam_envs.wording import near
from sweeps.progress import Start

PACKAGES = ("torch", "gymnasium", "numpy", "onnx", "minari")


def train(folder: Path, settings: Settings, out: Path, start: Start) -> Path:
    """Learn a policy from a data set, write it with its record, and return its path.

    The policy is for the environment of the data with normalised signals, and is evaluated on drawn
    plants, from which the data came.
    """
    if settings.algo not in ALGORITHMS:
        raise SettingsError(
            f"no algorithm named {settings.algo!r}{near(settings.algo, ALGORITHMS)}"
        )
    data = DataSet(folder)
    given = data.metadata["settings"]
    arguments = {**given["arguments"], "normalize": True}
    env: Any = gym.make(data.env, **arguments).unwrapped
    preset = presets.preset(data.env, "ppo")
    matrix = input_matrix(preset.network, tuple(env.signals.names()))
    policy = learn(data.transitions("train"), matrix, settings, start(settings.steps))
    set_elsewhere = ("randomize", "normalize")
    kwargs = {name: value for name, value in arguments.items() if name not in set_elsewhere}
    config = dataclasses.replace(
        preset, env_kwargs=kwargs, plants=dataclasses.replace(preset.plants, randomize=True)
    )
    card = {
        "schema": SCHEMA,
        "env": data.env,
        "env_kwargs": arguments,
        "plants": [env.plant.digest()],
        "signals": describe(env.signals),
        "action_signals": describe(env.action_signals),
        "algo": settings.algo,
        "steps": settings.steps,
        "seed": settings.seed,
        "settings": dataclasses.asdict(settings),
        "config": config.as_dict(),
        "data": {"id": data.metadata["dataset_id"], "settings": given, "sha256": digest(folder)},
        "versions": {
            "pam_envs": pam_envs.__version__,
            "python": platform.python_version(),
            **{name: version(name) for name in PACKAGES},
        },
    }
    path = out / POLICY
    out.mkdir(parents=True, exist_ok=True)
    write_policy(path, policy_bytes(policy, card), {"training": {"data": card["data"]}})
    return path


def digest(folder: Path) -> str:
    """Return the SHA-256 of the episodes of a data set."""
    with (folder / "data" / "main_data.hdf5").open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def policy_bytes(policy: Policy, card: dict[str, Any]) -> bytes:
    """Return the bytes of the policy file, a function of weights and card alone."""
    graph, inputs = Graph(), policy.inputs
    graph.add("Gemm", array(inputs.matrix), transB=1)
    graph.add("Sub", array(inputs.mean))
    seen = graph.add("Div", array(inputs.deviation))
    graph.layers(policy.layers)
    graph.join("Concat", [graph.last, seen], axis=1)
    graph.linear(policy.head)
    actions = len(card["action_signals"])
    graph.add("Max", np.full(actions, -1.0, np.float32))
    graph.add("Min", np.full(actions, 1.0, np.float32))
    made = graph.model(len(card["signals"]), actions, corrects=False)
    made.metadata_props.add(key=CARD, value=json.dumps(card, sort_keys=True))
    onnx.checker.check_model(made)
    check_graph(made)
    data: bytes = made.SerializeToString(deterministic=True)
    return data
