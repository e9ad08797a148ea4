"""Tiny settings, and training with them."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
import torch
import yaml
from rich.console import Console

from agents.policies.policy_file import CARD
from agents.settings import presets as configs
from agents.training import train
from agents.training.record import Run

QUIET = Console(quiet=True)

ID = "PAM/MusclePositioning-v0"
SHORT = {"episode_seconds": 0.3, "reference": "mixed", "load": None}
LOOK = {"interval": 512, "episodes": 4, "settle_seconds": 0.1}
NARROW = {"hidden": [16], "activation": "tanh"}
KINDS = yaml.safe_load(Path(__file__).with_name("kinds.yaml").read_text(encoding="utf-8"))


def tiny(algo: str = "ppo", **changes: Any) -> configs.Config:
    """Return settings that train in about a second, with many automatic resets."""
    plain = configs.preset(ID, algo).as_dict()
    plain |= {"num_envs": 8, "steps": 1024, "checkpoint_steps": 256, "env_kwargs": SHORT}
    if algo in configs.ON_POLICY:
        plain[algo] |= {"n_steps": 16, "batch_size": 64}
    else:
        plain[algo] |= {"learning_starts": 256, "gradient_steps": 1, "buffer_size": 600}
    if algo == "recurrent_ppo":
        plain[algo] |= {"lstm_size": 8, "n_epochs": 1}
    for name in ("evaluation", "plants"):
        plain.pop(name, None)
    own = {**plain[algo], **changes.get(algo, {})}
    return configs.from_mapping({**plain, **changes, algo: own})


def kind(name: str, **changes: Any) -> configs.Config:
    """Return tiny settings of a kind of policy."""
    return tiny(**{**KINDS[name], **changes})


def with_card(source: Path, **changes: Any) -> bytes:
    """Return a policy file with entries of its card changed."""
    model = onnx.load_model(source)
    card = {entry.key: entry.value for entry in model.metadata_props}[CARD]
    del model.metadata_props[:]
    model.metadata_props.add(key=CARD, value=json.dumps({**json.loads(card), **changes}))
    return bytes(model.SerializeToString())


def trained(folder: Path, config: configs.Config, seed: int = 3) -> Any:
    """Train and return the model; the folder holds checkpoint and policy."""
    run = Run(config, seed, folder)
    model = train.start(run)
    train.train(run, model, QUIET)
    return model


class Killed(Exception):
    """Takes the place of a kill."""


def killed_after(run: Run, steps: int) -> None:
    """Train, and stop without any clean-up once ``steps`` are passed."""
    model = train.start(run)
    ordinary = model.collect_rollouts

    def collect(*arguments: Any, **keywords: Any) -> Any:
        if model.num_timesteps >= steps:
            raise Killed
        return ordinary(*arguments, **keywords)

    model.collect_rollouts = collect
    with pytest.raises(Killed):
        train.train(run, model, QUIET)
    np.random.seed(999)  # noqa: NPY002  (a new process starts with other random numbers)
    torch.manual_seed(999)
